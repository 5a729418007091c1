#include "luxfield/core/console.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <memory>
#include <string>

#include "luxfield/core/printable.h"
#include "luxfield/core/progress.h"

namespace luxfield::core {
namespace {

constexpr double kRedraw_s = 0.1;

// One job's line after the other's.
class ProgressLine {
 public:
  explicit ProgressLine(bool terminal) : terminal_(terminal) {}

  void Show(const ProgressReport& report) {
    if (report.ended) {
      if (open_) std::fputc('\n', stderr);
      *this = ProgressLine(terminal_);
      return;
    }
    const double fraction =
        report.total ? static_cast<double>(report.done) / static_cast<double>(report.total) : 1.0;
    const bool last = report.done >= report.total;
    const std::string line = Line(report, fraction, last);
    if (terminal_)
      Redraw(line, report.elapsed_s, last);
    else
      PrintTenths(line, report.elapsed_s, fraction, last);
  }

 private:
  static std::string Line(const ProgressReport& report, double fraction, bool last) {
    std::string line = fmt::format("{} {:3.0f} %", report.label, 100 * fraction);
    if (last)
      line += fmt::format("  in {}", FormatDuration(report.elapsed_s));
    else if (report.elapsed_s > 1)
      line += fmt::format("  ETA {}", FormatDuration(report.elapsed_s * (1 / fraction - 1)));
    if (!report.note.empty()) line += "  " + report.note;
    return line;
  }

  void Redraw(const std::string& line, double elapsed_s, bool last) {
    if (!last && elapsed_s - drawn_s_ < kRedraw_s) return;
    drawn_s_ = elapsed_s;
    ObeyedByTerminal("\r\033[K");
    fmt::print(stderr, "{}", OnOneLine(line));
    std::fflush(stderr);
    open_ = !last;
    if (last) std::fputc('\n', stderr);
  }

  void PrintTenths(const std::string& line, double elapsed_s, double fraction, bool last) {
    const int tenth = static_cast<int>(fraction * 10);
    if (tenth <= tenth_ || (!last && elapsed_s <= 1)) return;
    tenth_ = tenth;
    fmt::print(stderr, "{}\n", OnOneLine(line));
  }

  bool terminal_;
  double drawn_s_ = 0;
  int tenth_ = 0;
  bool open_ = false;
};

}  // namespace

Execution OnConsole(bool quiet, int threads) {
  Execution execution;
  execution.threads = threads;
  execution.message = [](Severity severity, const std::string& message) {
    fmt::print(stderr, "luxfield: {}{}\n", severity == Severity::kWarning ? "warning: " : "",
               OnOneLine(message));
  };
  if (!quiet)
    execution.progress = [line = std::make_shared<ProgressLine>(::isatty(STDERR_FILENO) == 1)](
                             const ProgressReport& report) { line->Show(report); };
  return execution;
}

}  // namespace luxfield::core
