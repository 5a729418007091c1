#include "luxfield/cli/program.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <new>
#include <optional>
#include <sstream>
#include <system_error>

#include "luxfield/cli/build_facts.h"
#include "luxfield/cli/named_files.h"
#include "luxfield/cli/standard_streams.h"
#include "luxfield/core/console.h"
#include "luxfield/core/nearest.h"
#include "luxfield/core/outputs.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/printable.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/version.h"

namespace luxfield::cli {
namespace {

// Verbs of the design that this version, or this build of it, does not have: refused by name instead
// of "unknown".
constexpr std::array kAbsentVerbs = {"view"};

// Verbs that read again what they have written, or keep what they have at a failure: their files
// come into being as they go, those of all others together at the end (core/outputs.h).
constexpr std::array<std::string_view, 5> kWriteAsTheyGo = {"bench", "capture", "demo", "shard",
                                                            "verify"};

void PrintError(const std::string& message) {
  static const bool terminal = isatty(STDERR_FILENO);
  if (terminal) core::ObeyedByTerminal("\033[1;31m");  // bold, red
  fmt::print(stderr, "luxfield: ");
  if (terminal) core::ObeyedByTerminal("\033[0m");
  fmt::print(stderr, "{}\n", core::OnOneLine(message));
}

// ", did you mean 'render'?", or nothing where no known word is near.
std::string Suggestion(std::string_view word, const std::vector<std::string>& known) {
  const auto nearest = core::Nearest(word, known);
  return nearest ? fmt::format("; did you mean '{}'?", *nearest) : "";
}

std::vector<std::string> Names(const std::vector<const CLI::App*>& verbs) {
  std::vector<std::string> names;
  for (const CLI::App* verb : verbs) names.push_back(verb->get_name());
  return names;
}

// The verb that was parsed, or the name behind it; `words` gets both, each with a space behind it.
const CLI::App& Parsed(const CLI::App& app, std::string* words) {
  const CLI::App* verb = &app;
  while (!verb->get_subcommands().empty()) {
    verb = verb->get_subcommands().front();
    *words += verb->get_name() + " ";
  }
  return *verb;
}

// What is wrong, with a pointer to the help of the verb.
std::string WithHelp(const std::string& what, const std::string& words) {
  return fmt::format("{}; see `luxfield {}--help`", what, words);
}

// An option, or another word, that the verb does not know.
std::string UnknownWord(const CLI::App& verb, const std::string& word) {
  std::vector<std::string> options;
  for (const CLI::Option* option : verb.get_options()) options.push_back(option->get_name());
  return fmt::format("'{}' does not know {}{}", verb.get_name(), core::Printable(word),
                     Suggestion(word, options));
}

// A misspelt option is the reason of whatever else seems wrong: that one is missing, or that its
// value is no file for the verb to read.
std::optional<std::string> MisspeltOption(const CLI::App& app) {
  std::string words;
  const CLI::App& verb = Parsed(app, &words);
  if (&verb == &app) return {};
  for (const std::string& extra : verb.remaining(true)) {
    if (extra == "--") break;  // behind it are no options
    if (extra.starts_with("-")) return WithHelp(UnknownWord(verb, extra), words);
  }
  return {};
}

std::string ParseErrorText(const CLI::App& app, const CLI::ParseError& error) {
  if (const auto misspelt = MisspeltOption(app)) return *misspelt;
  std::string words, what = error.what();
  const CLI::App& verb = Parsed(app, &words);
  const bool extras = dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr;
  if (extras && &verb != &app && !verb.remaining(true).empty())
    what = UnknownWord(verb, verb.remaining(true).front());
  return WithHelp(what, words);
}

// Nothing that is named is an empty word, as a variable of the shell may be that was not set.
void RequireWords(const CLI::App& app) {
  std::string words;
  const CLI::App& verb = Parsed(app, &words);
  for (const CLI::Option* option : verb.get_options())
    for (const std::string& text : option->results())
      if (text.empty() && !option->get_inject_separator())  // between groups of numbers
        throw InputError(WithHelp(fmt::format("{} is empty", option->get_name()), words));
}

// Numbers on the command line: the parser takes nan, inf and 1e300.
void RequirePlausible(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options())
    for (const std::string& text : option->results()) {
      double value = 0;
      if (option->get_type_name().starts_with("FLOAT") && CLI::detail::lexical_cast(text, value) &&
          !core::Range{}.Holds(value))
        throw InputError(fmt::format("{} {} is no number within {:g}; give a finite one",
                                     option->get_name(), text, core::kLargestNumber));
    }
  for (const CLI::App* verb : app.get_subcommands()) RequirePlausible(*verb);
}

// The first word is the verb, and that behind a group one of its names. CLI11 alone would look for
// them among the words behind. A name that a group does not have is refused with those it has.
void RequireVerb(const CLI::App& app, int argc, char** argv) {
  const std::string_view word = argc > 1 ? argv[1] : "";
  if (word.empty())
    throw InputError("a verb is missing, as in `luxfield demo`; `luxfield --help` lists them");
  if (word.starts_with("-")) return;
  const auto verbs = app.get_subcommands({});
  const auto verb = std::find_if(verbs.begin(), verbs.end(),
                                 [&](const CLI::App* one) { return one->get_name() == word; });
  for (const char* absent : kAbsentVerbs)
    if (verb == verbs.end() && word == absent)
      throw InputError(fmt::format(
          "the verb '{}' is not built in this version; `luxfield --help` lists those that are",
          word));
  if (verb == verbs.end())
    throw InputError(fmt::format("there is no verb '{}'{}; `luxfield --help` lists them",
                                 core::Printable(word), Suggestion(word, Names(verbs))));
  const auto names = Names((*verb)->get_subcommands({}));
  const std::string_view name = argc > 2 ? argv[2] : "";
  if (names.empty() || (*verb)->get_require_subcommand_min() == 0 || name.starts_with("-") ||
      std::find(names.begin(), names.end(), name) != names.end())
    return;
  const std::string what = name.empty()
                               ? fmt::format("'{}' needs a name", word)
                               : fmt::format("'{}' does not know '{}'{}", word,
                                             core::Printable(name), Suggestion(name, names));
  throw InputError(WithHelp(fmt::format("{}; use one of {}", what, fmt::join(names, ", ")),
                            std::string(word) + " "));
}

// Does the work of `verb`, its --json included.
void RunVerb(const std::string& verb, const Action& action, const std::string& json_file) {
  std::optional<core::Outputs> outputs;
  if (std::find(kWriteAsTheyGo.begin(), kWriteAsTheyGo.end(), verb) == kWriteAsTheyGo.end())
    outputs.emplace();
  const core::Stopwatch stopwatch;
  core::Json result = action();
  if (!json_file.empty()) {
    result["verb"] = verb;
    result["version"] = LUXFIELD_VERSION;
    result["wall_s"] = stopwatch.WallSeconds();
    core::WriteJson(json_file, result);
  }
  if (outputs) outputs->PutInPlace();
}

// What the system refuses: 3 where it has run out of something or a device failed, else 2, the
// user's to mend.
int ExitCode(const std::error_code& code) {
  for (const std::errc lacking :
       {std::errc::no_space_on_device, std::errc::io_error, std::errc::read_only_file_system,
        std::errc::too_many_files_open, std::errc::too_many_files_open_in_system,
        std::errc::resource_unavailable_try_again, std::errc::not_enough_memory})
    if (code == lacking) return 3;
  return 2;
}

}  // namespace

Program::Program()
    : app_("luxfield measures real luminaires as light fields and lights virtual scenes with them.",
           "luxfield") {
  app_.require_subcommand(1);
  app_.set_version_flag(
      "--version", [] { return BuildFacts(); },
      "Print version, commit, build and libraries, and exit");
  app_.option_defaults()->always_capture_default();
  app_.footer(
      "Exit codes: 0 done, 1 a bug, 2 input or arguments wrong, 3 hardware, storage or a device "
      "failed,\n"
      "4 interrupted but resumable. `luxfield VERB --help` lists a verb's options with defaults "
      "and units.");
  app_.get_formatter()->column_width(38);
}

CLI::App& Program::AddVerb(std::string_view name, Action action) {
  return AddVerb(VerbNamed(name), std::move(action));
}

CLI::App& Program::AddVerb(const VerbName& verb, Action action) {
  return AddVerb(app_, std::string(verb.name), std::string(verb.description), std::move(action));
}

CLI::App& Program::AddGroup(const VerbName& verb) {
  CLI::App* group = app_.add_subcommand(std::string(verb.name), std::string(verb.description));
  group->require_subcommand(1);
  return *group;
}

CLI::App& Program::AddVerb(CLI::App& group, const std::string& name, const std::string& description,
                           Action action) {
  CLI::App* verb = group.add_subcommand(name, description);
  verb->option_defaults()->always_capture_default();
  verb->add_option("--json", common_.json_file, "Write the figures to this JSON file as well")
      ->capture_default_str()
      ->check(OutputFile());
  verb->add_option("--seed", common_.seed,
                   "Seed of every random number (default: the input file's own, else 1)");
  verb->add_option("--threads", common_.threads, "CPU threads, 0 for all cores")
      ->check(CLI::Range(0, 4096));
  verb->add_flag("--quiet", common_.quiet, "No progress on stderr");
  verb->callback([this, action = std::move(action)] { chosen_ = action; });
  return *verb;
}

int Program::Run(int argc, char** argv) {
  try {
    RequireVerb(app_, argc, argv);
    try {
      app_.parse(argc, argv);
    } catch (const CLI::Success& success) {
      std::ostringstream text;
      const int code = app_.exit(success, text, text);  // --help, --version
      fmt::print("{}", text.str());
      FlushStandardOutput();
      return code;
    } catch (const CLI::ParseError& error) {
      PrintError(ParseErrorText(app_, error));
      return 2;
    } catch (const InputError&) {  // of a file that an option names
      const auto misspelt = MisspeltOption(app_);
      if (!misspelt) throw;
      throw InputError(*misspelt);
    }
    RequireWords(app_);
    RequirePlausible(app_);
    core::InstallInterruptHandler();
    // Loops of other libraries know no execution.
    std::optional<tbb::global_control> everywhere;
    if (common_.threads > 0)
      everywhere.emplace(tbb::global_control::max_allowed_parallelism, common_.threads);
    core::RunWith(core::OnConsole(common_.quiet, common_.threads), [&] {
      RunVerb(app_.get_subcommands().front()->get_name(), chosen_, common_.json_file);
    });
    FlushStandardOutput();
    return 0;
  } catch (const Error& error) {
    PrintError(error.what());
    return error.exit_code();
  } catch (const std::bad_alloc&) {
    PrintError(
        "out of memory; close other programs, or use fewer positions, a smaller lattice or a "
        "machine with more");
    return 3;
  } catch (const std::filesystem::filesystem_error& error) {
    const std::string path = error.path1().string();
    PrintError(fmt::format("{}: cannot be used: {}; check the path and who may read and write it",
                           path.empty() ? "a file or folder" : path, error.code().message()));
    return ExitCode(error.code());
  } catch (const std::system_error& error) {
    try {
      FlushStandardOutput();  // printing more than the stream's buffer holds throws at once
    } catch (const DeviceError& unwritten) {
      PrintError(unwritten.what());
      return unwritten.exit_code();
    }
    PrintError(fmt::format(
        "the system refuses what this verb needs: {}; raise the limit (`ulimit -a` lists them), or "
        "end other programs",
        error.what()));
    return ExitCode(error.code());
  } catch (const std::exception& error) {
    PrintError(
        fmt::format("internal error: {}; please report it with the command line", error.what()));
    return 1;
  }
}

std::string FormatBytes(double bytes) {
  const char* units[] = {"B", "KiB", "MiB", "GiB", "TiB"};
  int unit = 0;
  while (bytes >= 1024 && unit < 4) {
    bytes /= 1024;
    ++unit;
  }
  return fmt::format("{:.{}f} {}", bytes, unit == 0 ? 0 : 1, units[unit]);
}

void RequireExtension(const std::string& path, const std::string& extension,
                      const std::string& option) {
  if (!path.ends_with(extension))
    throw InputError(
        fmt::format("{} = {} must end in {}; name the output so", option, path, extension));
}

double ParseQuantity(const std::string& text, const char* option, const Units& units) {
  std::size_t end = 0;
  double value = 0;
  try {
    value = std::stod(text, &end);
  } catch (const std::exception&) {
    end = 0;
  }
  std::string example;
  for (const auto& [unit, factor] : units) {
    if (end > 0 && text.substr(end) == unit && core::Range{}.Holds(value)) return value * factor;
    example += fmt::format("{}5{}", example.empty() ? "" : " or ", unit);
  }
  throw InputError(fmt::format("{} '{}' is not a number with its unit; write it like {}", option,
                               text, example));
}

}  // namespace luxfield::cli
