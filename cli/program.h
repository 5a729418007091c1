// The command line: one binary, one verb per stage (docs/verbs.md).
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "luxfield/cli/verb_list.h"
#include "luxfield/core/json.h"

namespace luxfield::cli {

// Options every verb has.
struct Common {
  std::string json_file;
  std::optional<std::uint64_t> seed;  // absent: the input file's own, or 1
  int threads = 0;
  bool quiet = false;
};

// Does the work and returns what --json writes; human text goes to stdout, progress to stderr.
using Action = std::function<core::Json()>;

class Program {
 public:
  Program();
  // Runs the verb named on the command line and returns the exit code (0, 1, 2, 3 or 4).
  int Run(int argc, char** argv);

  // A verb of the list (cli/verb_list.h) with the common options; the caller adds its own and hands
  // over the action. Options must be captured by shared_ptr: they are filled in after the verb is
  // declared.
  CLI::App& AddVerb(std::string_view name, Action action);
  // One of a room above this one.
  CLI::App& AddVerb(const VerbName& verb, Action action);
  // A verb that is followed by a name of its own, and these names, likewise.
  CLI::App& AddGroup(const VerbName& verb);
  CLI::App& AddVerb(CLI::App& group, const std::string& name, const std::string& description,
                    Action action);
  const Common& common() const { return common_; }

 private:
  CLI::App app_;
  Common common_;
  Action chosen_;
};

// Verbs, a file each (cli/verb_*.cc).
void AddDevices(Program& program);
void AddSimulate(Program& program);
void AddSky(Program& program);
void AddPlan(Program& program);
void AddCapture(Program& program);
void AddVerify(Program& program);
void AddReport(Program& program);
void AddCalibrate(Program& program);
void AddFilter(Program& program);
void AddProbe(Program& program);
void AddMerge(Program& program);
void AddReconstruct(Program& program);
void AddBudget(Program& program);
void AddImport(Program& program);
void AddExport(Program& program);
void AddPreprocess(Program& program);
void AddShard(Program& program);
void AddRender(Program& program);
void AddRelight(Program& program);
void AddPhotometry(Program& program);
void AddInfo(Program& program);
void AddCompare(Program& program);
void AddCache(Program& program);
void AddDemo(Program& program);

// "12.3 MiB"
std::string FormatBytes(double bytes);

// "0.5%" with units {{"%", 0.01}} is 0.005. Throws InputError naming the option for a text that is
// not a number with one of the units.
using Units = std::vector<std::pair<std::string, double>>;  // name and factor
double ParseQuantity(const std::string& text, const char* option, const Units& units);

// Throws InputError unless `path` ends in `extension`, naming the option that holds it.
void RequireExtension(const std::string& path, const std::string& extension,
                      const std::string& option);

}  // namespace luxfield::cli
