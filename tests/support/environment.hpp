#pragma once
/// \file What the environment asks of a long test.

#include <cstdlib>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace hemowalk::test {

/// The numbers of a list with commas, "4,8,16"; blanks round a number do not count.
/// \throws std::invalid_argument naming what is no number.
inline std::vector<double> numbers_of(const std::string& text) {
  std::vector<double> numbers;
  std::stringstream list(text);
  for (std::string word; std::getline(list, word, ',');) {
    std::istringstream one(word);
    double number = 0;
    if (!(one >> number && (one >> std::ws).eof()))
      throw std::invalid_argument("`" + word + "` is no number (of the list `" + text + "`) write 4,8,16");
    numbers.push_back(number);
  }
  return numbers;
}

/// What HEMOWALK_ACCELERATIONS asks for, else \p usual.
inline std::vector<double> accelerations(const std::string& usual) {
  const char* asked = std::getenv("HEMOWALK_ACCELERATIONS");
  return numbers_of(asked ? asked : usual);
}

}  // namespace hemowalk::test
