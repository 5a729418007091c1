// luxfield report SESSION [-o X.html]
#include <fmt/format.h>

#include <memory>

#include "luxfield/cli/named_files.h"
#include "luxfield/cli/program.h"
#include "luxfield/cli/reports/session_report.h"

namespace luxfield::cli {
namespace {

struct Options {
  std::string session, output = "report.html";
  bool verify = false;
};

core::Json Run(const Options& options) {
  RequireExtension(options.output, ".html", "-o");
  const auto review = capture::ReviewSession(options.session, options.verify);
  PrintSessionReview(review, options.session);
  WriteSessionReport(review, options.session, options.output);
  fmt::print("wrote {}\n", options.output);
  return capture::ToJson(review);
}

}  // namespace

void AddReport(Program& program) {
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb("report", [options] { return Run(*options); });
  verb.add_option("SESSION", options->session, "The session folder, sealed or not")
      ->required()
      ->check(InputSession());
  verb.add_option("-o,--output", options->output, "The .html page to write")->check(OutputFile());
  verb.add_flag("--verify", options->verify,
                "Also check every byte against its hash, as `luxfield verify` does");
}

}  // namespace luxfield::cli
