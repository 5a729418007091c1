// luxfield verify SESSION [--salvage]
#include <fmt/format.h>

#include <memory>

#include "luxfield/capture/take/capture.h"
#include "luxfield/cli/named_files.h"
#include "luxfield/cli/program.h"
#include "luxfield/session/session_check.h"

namespace luxfield::cli {
namespace {

struct Options {
  std::string session;
  bool salvage = false;
};

// What the person is told to do about a session that has problems.
std::string RemedyOf(const session::SessionCheck& check) {
  if (check.leads_out) return "do not trust it; take the session from where it was captured";
  if (check.damaged)
    return "`luxfield verify --salvage` keeps what is whole, then `capture --resume` retakes the "
           "rest";
  return check.sealed ? "nothing that was measured is damaged"
                      : "nothing is damaged; `luxfield capture --resume` goes on";
}

core::Json Run(const Options& options) {
  core::Json json;
  if (options.salvage) {
    const auto salvaged = session::SalvageSession(options.session);
    if (salvaged.old_journal.empty())
      fmt::print("{}: nothing to salvage: no line, no frame and no manifest is damaged\n",
                 options.session);
    else
      fmt::print(
          "{}: journal rewritten, {} lines and {} frames kept, {} lines and {} frames lost; the "
          "old one is {}\n",
          options.session, salvaged.lines_kept, salvaged.frames_kept, salvaged.lines_lost,
          salvaged.frames_lost, salvaged.old_journal.filename().string());
    json["salvage"] = {{"lines_kept", salvaged.lines_kept},
                       {"lines_lost", salvaged.lines_lost},
                       {"frames_kept", salvaged.frames_kept},
                       {"frames_lost", salvaged.frames_lost}};
  }
  const auto check = capture::VerifySession(options.session);
  fmt::print("{}: {}, {} frames match their hashes, {} positions whole\n", options.session,
             check.sealed ? "sealed" : "not sealed", check.frames, check.positions);
  for (const auto& problem : check.problems) fmt::print("  {}\n", problem);
  json["sealed"] = check.sealed;
  json["frames"] = check.frames;
  json["positions"] = check.positions;
  json["problems"] = check.problems;
  if (!check.problems.empty())
    throw InputError(options.session,
                     fmt::format("{} problem{} found", check.problems.size(),
                                 check.problems.size() == 1 ? "" : "s"),
                     RemedyOf(check));
  return json;
}

}  // namespace

void AddVerify(Program& program) {
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb("verify", [options] { return Run(*options); });
  verb.add_option("SESSION", options->session, "The session folder")
      ->required()
      ->check(InputSession());
  verb.add_flag("--salvage", options->salvage,
                "Rewrite the journal from its intact lines and frames first");
}

}  // namespace luxfield::cli
