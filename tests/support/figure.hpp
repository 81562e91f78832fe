#pragma once
/// \file Figures of docs/evidence. A validation test that has curves to show writes NAME.csv (long form:
/// curve, x, y, error) and, where gnuplot is installed, NAME.svg into the folder of HEMOWALK_FIGURES, or
/// `figures` where the test runs.

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace hemowalk::test {

class Figure {
 public:
  enum class Style { line, dashes, points, dots };  ///< dots: a line with points on it

  /// Axis titles with units.
  Figure(std::string name, std::string title, std::string x, std::string y)
      : name_(std::move(name)), title_(std::move(title)), x_(std::move(x)), y_(std::move(y)) {}

  /// \p error: half lengths of the bars, or empty. Curves of one \p colour (0 to 7) belong together; -1 is
  /// grey.
  Figure& curve(const std::string& label, Style style, int colour, const std::vector<double>& x,
                const std::vector<double>& y, const std::vector<double>& error = {}) {
    curves_.push_back({label, style, colour, x, y, error});
    return *this;
  }
  /// Any line of gnuplot, e.g. "set logscale x".
  Figure& with(const std::string& setting) {
    settings_ += setting + "\n";
    return *this;
  }

  void write() const {
    const char* chosen = std::getenv("HEMOWALK_FIGURES");
    const std::filesystem::path folder = chosen ? chosen : "figures";
    std::filesystem::create_directories(folder);
    const std::string stem = (folder / name_).string();
    std::ofstream table(stem + ".csv");
    table << "curve,x,y,error\n";
    for (const auto& c : curves_)
      for (std::size_t i = 0; i < c.x.size(); ++i)
        if (std::isfinite(c.y[i])) {
          table << '"' << c.label << "\"," << c.x[i] << ',' << c.y[i] << ',';
          if (!c.error.empty()) table << c.error[i];
          table << '\n';
        }
    table.close();
    draw(stem);
    std::printf("figure: %s.csv\n", stem.c_str());
  }

 private:
  struct Curve {
    std::string label;
    Style style;
    int colour;
    std::vector<double> x, y, error;
  };

  /// For a string in single quotes, where gnuplot takes two for one.
  static std::string quotable(const std::string& text) {
    std::string out;
    for (const char c : text) out += c == '\'' ? "''" : std::string(1, c);
    return out;
  }

  void draw(const std::string& stem) const {
    // Okabe and Ito 2008: told apart by colour-blind readers too.
    static const char* const colours[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                          "#e69f00", "#56b4e9", "#000000", "#b8a800"};
    const std::string script = stem + ".gnuplot";
    FILE* plot = std::fopen(script.c_str(), "w");
    if (!plot) return;
    std::fprintf(plot,
                 "set encoding utf8\nset terminal svg size 860,400 font 'sans-serif,13' background "
                 "'#ffffff'\nset output '%s.svg'\n"
                 "set title '%s' noenhanced\nset xlabel '%s' noenhanced\nset ylabel '%s' noenhanced\n"
                 "set grid lc rgb '#dddddd'\nset key outside right center noenhanced samplen 2\n"
                 "set border 3 lc rgb '#444444'\nset tics nomirror\n%s",
                 stem.c_str(), quotable(title_).c_str(), quotable(x_).c_str(), quotable(y_).c_str(),
                 settings_.c_str());
    for (std::size_t i = 0; i < curves_.size(); ++i) {
      const Curve& c = curves_[i];
      const std::string rgb = c.colour < 0 ? "#888888" : colours[c.colour % 8];
      std::string with;
      if (c.style == Style::line) with = "lines lw 2";
      if (c.style == Style::dashes) with = "lines lw 1.5 dt 2";
      if (c.style == Style::points) with = c.error.empty() ? "points pt 7 ps 0.5" : "yerrorbars pt 7 ps 0.5";
      if (c.style == Style::dots)
        with = c.error.empty() ? "linespoints lw 1.5 pt 7 ps 0.5" : "yerrorlines lw 1.5 pt 7 ps 0.5";
      std::fprintf(plot, "%s '-' using %s with %s lc rgb '%s' title '%s'", i ? "," : "plot",
                   c.error.empty() ? "1:2" : "1:2:3", with.c_str(), rgb.c_str(), quotable(c.label).c_str());
    }
    std::fprintf(plot, "\n");
    for (const Curve& c : curves_) {
      for (std::size_t i = 0; i < c.x.size(); ++i)
        if (std::isfinite(c.y[i]))
          std::fprintf(plot, "%.6g %.6g %.6g\n", c.x[i], c.y[i], c.error.empty() ? 0. : c.error[i]);
      std::fprintf(plot, "e\n");
    }
    std::fclose(plot);
    if (std::system(("gnuplot '" + script + "' > /dev/null 2>&1").c_str()) != 0)
      std::printf("no drawing: gnuplot is missing or failed\n");
    std::filesystem::remove(script);
  }

  std::string name_, title_, x_, y_, settings_;
  std::vector<Curve> curves_;
};

}  // namespace hemowalk::test
