#pragma once
/// \file Progress of a long job: a bar with the time left on a terminal, now and then a plain line elsewhere.

#include <functional>
#include <string>

namespace hemowalk {

/// "1:23:45", "12:07", "8 s"; "?" for what is not finite or negative.
std::string format_duration(double seconds);

/// One line of state: "run 3 [#####-----]  50 %  left 2:10  step 4000". \p width of the bar in characters, 0
/// = no bar.
std::string progress_line(const std::string& title, double fraction, double elapsed, const std::string& note,
                          int width);

class Progress {
 public:
  struct Output {
    bool terminal = false;                          ///< redraw one line, else write new ones
    std::function<void(const std::string&)> write;  ///< receives text as it is to appear
    std::function<double()> clock;                  ///< s
    double interval = 0;  ///< s between updates; 0 = 0.2 on a terminal, 30 elsewhere
  };
  /// Writes to stderr; asks it whether it is a terminal.
  explicit Progress(std::string title);
  Progress(std::string title, Output output);
  /// Ends the line of a bar that was not finished.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// \p fraction in [0, 1]; cheap to call often: writes at most once per interval, and always at the end.
  void update(double fraction, const std::string& note = "");

 private:
  std::string title_;
  Output output_;
  double start_, last_;
  bool finished_ = false, drawn_ = false;
};

}  // namespace hemowalk
