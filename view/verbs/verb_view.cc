#include "luxfield/view/verbs/verb_view.h"

#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <iterator>
#include <map>
#include <memory>
#include <utility>

#include "luxfield/cli/named_files.h"
#include "luxfield/core/error.h"
#include "luxfield/core/outputs.h"
#include "luxfield/view/documents/open_input.h"
#include "luxfield/view/record/frame_times.h"
#include "luxfield/view/record/recording.h"
#include "luxfield/view/viewer.h"

namespace luxfield::view {
namespace {

struct Words {
  ViewerOptions viewer;
  std::string size, error, shadows = "traced";
  std::vector<std::string> reads;
  std::optional<double> exposure;
  std::vector<double> scale;
  std::string tone, layer;
  bool contours = false;
  bool false_colour = false;
  std::filesystem::path record, output;
  bool preview = false, bench = false;
};

// "640x480" with `separator` 'x', "12,34" with ','.
std::array<int, 2> ParsePair(const std::string& text, char separator, const char* option,
                             const char* example, int least) {
  std::array<int, 2> pair{};
  char between = 0;
  int used = 0;
  const int found = std::sscanf(text.c_str(), "%6d%c%6d%n", &pair[0], &between, &pair[1], &used);
  if (found != 3 || between != separator || used != static_cast<int>(text.size()) ||
      pair[0] < least || pair[1] < least || pair[0] > 16384 || pair[1] > 16384)
    throw InputError(
        fmt::format("{} = {} is no pair of whole numbers from {} to 16384; give it as {}", option,
                    text, least, example));
  return pair;
}

constexpr std::pair<const char*, Layer> kLayers[] = {
    {"radiance", Layer::kRadiance}, {"irradiance", Layer::kIrradiance},
    {"coverage", Layer::kCoverage}, {"samples", Layer::kSamples},
    {"noise", Layer::kNoise},       {"lab", Layer::kLab},
    {"alpha", Layer::kLightShare},  {"images", Layer::kImageShare}};

template <typename Value, std::size_t N>
std::map<std::string, Value> ByName(const std::pair<const char*, Value> (&names)[N]) {
  return {std::begin(names), std::end(names)};
}

std::map<std::string, render::ToneCurve> CurvesByName() {
  return {render::ToneCurves().begin(), render::ToneCurves().end()};
}

// What false colours are to show; `look` is of them.
void ReadFalseColours(const Words& words, Look& look) {
  if (!words.layer.empty()) look.layer = ByName(kLayers).at(words.layer);
  if (look.layer == Layer::kLab && words.viewer.reference.empty())
    throw InputError("--layer lab needs --reference: the picture that it compares with");
  look.contours = words.contours;
  if (words.scale.empty()) return;
  look.scale = render::FalseColourScale{words.scale[0], words.scale[1]};
  const bool above = IsLinear(look.layer) ? words.scale[0] >= 0 : words.scale[0] > 0;
  if (!above || !(words.scale[1] > words.scale[0]))
    throw InputError(
        fmt::format("--scale {} {} must rise from above 0", words.scale[0], words.scale[1]));
}

std::optional<Look> LookOf(const Words& words) {
  if (words.exposure && words.false_colour)
    throw InputError("--exposure contradicts --false-colour; drop one of them");
  if (!words.tone.empty() && (words.exposure || words.false_colour))
    throw InputError("--tone contradicts --exposure and --false-colour; drop it or them");
  for (const auto& [option, given] :
       {std::pair{"--scale", !words.scale.empty()}, std::pair{"--layer", !words.layer.empty()},
        std::pair{"--contours", words.contours}})
    if (given && !words.false_colour)
      throw InputError(fmt::format("{} is of --false-colour; give that too, or drop it", option));
  if (!words.exposure && !words.false_colour && words.tone.empty()) return {};
  Look look;
  if (words.exposure) {
    if (!(*words.exposure > 0))
      throw InputError(fmt::format("--exposure = {} must be above 0", *words.exposure));
    look.tone = Tone::kLinear;
    look.exposure = *words.exposure;
  } else if (words.false_colour) {
    look.tone = Tone::kFalseColour;
    ReadFalseColours(words, look);
  } else {
    look.tone = ToneOf(CurvesByName().at(words.tone));
  }
  return look;
}

core::Json ToJson(const Reading& reading) {
  core::Json json{
      {"column", reading.column}, {"row", reading.row}, {"luminance", reading.luminance}};
  if (reading.luminance_sigma) json["luminance_sigma"] = *reading.luminance_sigma;
  if (reading.illuminance) json["illuminance"] = *reading.illuminance;
  if (const auto sigma = reading.IlluminanceSigma()) json["illuminance_sigma"] = *sigma;
  if (reading.measured_rel_sigma) json["measured_rel_sigma"] = *reading.measured_rel_sigma;
  if (reading.position)
    json["position_m"] = {reading.position->x, reading.position->y, reading.position->z};
  return json;
}

core::Json ToJson(const ViewerResult& result) {
  core::Json json{{"frames", result.frames}, {"settled", result.settled}};
  if (result.picture.width > 0) {
    json["width"] = result.picture.width;
    json["height"] = result.picture.height;
    json["unit"] = lightfield::FluxUnitName(result.unit);
  }
  if (result.error) json["estimated_rel_rmse"] = *result.error;
  json["readings"] = json["probes"] = core::Json::array();
  for (const Reading& reading : result.readings) json["readings"].push_back(ToJson(reading));
  for (const Reading& reading : result.probes) json["probes"].push_back(ToJson(reading));
  return json;
}

core::Json ToJson(const Recording& recording) {
  core::Json json{{"width", recording.width},
                  {"height", recording.height},
                  {"frames_per_s", recording.frames_per_s},
                  {"frames", core::Json::array()}};
  for (const RecordedFrame& frame : recording.frames) {
    json["frames"].push_back({{"t_s", frame.t_s}, {"samples", frame.samples}});
    if (frame.error) json["frames"].back()["estimated_rel_rmse"] = *frame.error;
  }
  return json;
}

// Says again what the window showed, with the exit code of the failure.
[[noreturn]] void Throw(const Failure& failure) {
  if (failure.exit_code == 2) throw InputError(failure.sentence);
  throw DeviceError(failure.sentence);
}

// Options of a window say nothing of a recording or a bench, and the other way round.
void RefuseUnread(const Words& words) {
  if (words.record.empty() && (!words.output.empty() || words.preview))
    throw InputError("--output and --preview are of --record; give that too, or drop them");
  if (!words.record.empty() && words.output.empty())
    throw InputError("--record needs --output: a folder, or the name of a video");
  if (!words.record.empty() && words.bench)
    throw InputError("--record contradicts --bench; drop one of them");
  if (words.record.empty() && !words.bench) return;
  if (!words.viewer.screenshot.empty() || words.viewer.frames || words.viewer.until_closed ||
      words.viewer.bare || words.viewer.wait || !words.size.empty() || !words.reads.empty())
    throw InputError(
        "--record and --bench open no window: drop --screenshot, --frames, --until-closed, --bare, "
        "--wait, --size and --read");
}

core::Json ToJson(const FrameTimes& times) {
  core::Json json{{"width", times.width},
                  {"height", times.height},
                  {"device", times.device},
                  {"tables_s", times.first.Sum()},
                  {"first",
                   {{"scene_s", times.first.scene_s},
                    {"device_s", times.first.device_s},
                    {"lamps_s", times.first.lamps_s},
                    {"tables_s", times.first.tables_s},
                    {"picture_s", times.first.picture_s}}},
                  {"refined_s", times.refined_s},
                  {"refined_core_s", times.refined_core_s},
                  {"estimated_rel_rmse", times.refined_error},
                  {"samples", times.samples},
                  {"moving", core::Json::array()}};
  for (const MovingTimes& row : times.moving)
    json["moving"].push_back({{"moving", row.moving},
                              {"shadows", row.shadows},
                              {"frame_s", row.frame_s},
                              {"core_s", row.core_s},
                              {"picture_core_s", row.picture_core_s},
                              {"colours_core_s", row.colours_core_s},
                              {"primary_s", row.primary_s},
                              {"lighting_s", row.lighting_s}});
  return json;
}

core::Json RunBench(const Words& words) {
  const SceneOptions& input = words.viewer.input;
  const FrameTimes times = MeasureFrameTimes({input, KindToLight(input.file)});
  const FirstTimes& first = times.first;
  fmt::print("{} x {} on {}\n", times.width, times.height, times.device);
  fmt::print(
      "  first picture {:.3g} s after all tables are in memory, {:.3g} s after the start: "
      "{:.3g} s scene, {:.3g} s device, {:.3g} s lamps, {:.3g} s tables\n",
      first.picture_s, first.Sum(), first.scene_s, first.device_s, first.lamps_s, first.tables_s);
  for (const MovingTimes& row : times.moving)
    fmt::print(
        "  {} moving, {:15}  {:5.3g} pictures/s, {:5.3g} core-ms: {:.3g} light, {:.3g} colours; "
        "{:.3g} ms primary visibility, {:.3g} ms lighting\n",
        row.moving, row.shadows ? "soft shadows" : "without shadows", 1 / row.frame_s,
        1e3 * row.core_s, 1e3 * row.picture_core_s, 1e3 * row.colours_core_s, 1e3 * row.primary_s,
        1e3 * row.lighting_s);
  fmt::print("  error {:.3g} % after {:.3g} s, {:.3g} core-s, {:.0f} samples a pixel\n",
             100 * times.refined_error, times.refined_s, times.refined_core_s, times.samples);
  return ToJson(times);
}

core::Json RunRecording(const Words& words) {
  RecordOptions options;
  options.input = words.viewer.input;
  options.path = words.record;
  options.output = words.output;
  options.preview = words.preview;
  if (words.viewer.look) options.look = *words.viewer.look;
  const Recording recording = Record(options);
  fmt::print("{}: {} frames of {} x {}\n", words.output.string(), recording.frames.size(),
             recording.width, recording.height);
  return ToJson(recording);
}

core::Json Run(Words words, const cli::Common& common) {
  RefuseUnread(words);
  ViewerOptions& options = words.viewer;
  if (!words.size.empty()) {
    const auto [width, height] = ParsePair(words.size, 'x', "--size", "1280x800", 1);
    options.size = {width, height};
  }
  for (const std::string& read : words.reads) {
    const auto [column, row] = ParsePair(read, ',', "--read", "120,44", 0);
    options.reads.push_back({column, row});
  }
  if (!words.error.empty())
    options.input.error = cli::ParseQuantity(words.error, "--error", {{"%", 0.01}});
  if (!(options.input.error > 0 && options.input.error <= 1))
    throw InputError(fmt::format("--error = {} must lie above 0 and be at most 100%", words.error));
  if (options.frames && options.screenshot.empty())
    throw InputError("--frames is of --screenshot; give that too, or drop it");
  if (options.until_closed && options.screenshot.empty())
    throw InputError("--until-closed is of --screenshot; give that too, or drop it");
  if (options.until_closed && (options.frames || options.wait))
    throw InputError("--until-closed contradicts --frames and --wait; drop it or them");
  if (!options.screenshot.empty())
    cli::RequireExtension(options.screenshot.string(), ".png", "--screenshot");
  options.look = LookOf(words);
  options.input.shadows = words.shadows == "traced";
  options.input.threads = common.threads;
  options.input.seed = common.seed.value_or(1);
  if (!words.record.empty()) return RunRecording(words);
  if (words.bench) return RunBench(words);
  const ViewerResult result = RunViewer(options);
  if (result.failure) {
    core::PutOutputsInPlace();  // the screenshot shows the sentence
    Throw(*result.failure);
  }
  for (const Reading& reading : result.readings) fmt::print("{}\n", Describe(reading, result.unit));
  return ToJson(result);
}

}  // namespace

void AddView(cli::Program& program) {
  auto words = std::make_shared<Words>();
  CLI::App& verb = program.AddVerb(
      kViewVerb, [words, &program]() -> core::Json { return Run(*words, program.common()); });
  verb.add_option("INPUT", words->viewer.input.file,
                  "A scene.toml, an .lf.exr, an .exr picture or a session's folder")
      ->required();
  verb.add_option("--screenshot", words->viewer.screenshot,
                  "Write what the window shows to this PNG and end, when it is settled or after "
                  "--frames")
      ->check(cli::OutputFile());
  verb.add_option("--record", words->record,
                  "Write the motion of camera and lamps that this path.toml says, without a window")
      ->check(cli::InputFile({core::FileKind::kMotionPath}));
  verb.add_option("-o,--output", words->output,
                  "Of --record: a folder for EXRs and PNGs, or a video (.mp4, .mkv, .mov, .webm) "
                  "that ffmpeg makes");
  verb.add_flag("--preview", words->preview,
                "Record what is shown while something moves, instead of refined pictures");
  verb.add_flag("--bench", words->bench,
                "Say how long pictures take while something moves, and until --error, without a "
                "window");
  verb.add_option("--size", words->size, "The window's, as 1280x800, pixels");
  verb.add_option("--frames", words->viewer.frames,
                  "Take the screenshot after so many frames that show something, settled or not")
      ->check(CLI::Range(1, 1000000));
  verb.add_flag(
      "--until-closed", words->viewer.until_closed,
      "Take the screenshot when the window is closed, as soon as nothing changes any more");
  verb.add_flag("--wait", words->viewer.wait, "Wait for a session that is not there yet");
  verb.add_flag("--bare", words->viewer.bare, "The picture alone, without panels (key H)");
  verb.add_option("--error", words->error,
                  "The relative RMSE of the luminance to refine to while nothing moves "
                  "(default: 0.5%)");
  verb.add_option("--shadows", words->shadows, "traced or none; of refined pictures")
      ->check(CLI::IsMember({"traced", "none"}));
  verb.add_option("--exposure", words->exposure,
                  "Start with the linear operator: radiance times this, clipped at 1");
  verb.add_flag("--false-colour", words->false_colour, "Start with false colours of the luminance");
  verb.add_option("--tone", words->tone,
                  "Start with exponential, hue (exponential, hue kept) or filmic (default: "
                  "exponential)")
      ->check(CLI::IsMember(CurvesByName()));
  verb.add_option(
          "--layer", words->layer,
          "What --false-colour shows: radiance, irradiance, coverage, samples, noise, lab, alpha "
          "(the light's share of samples) or images (their share that lights a point) "
          "(default: radiance)")
      ->check(CLI::IsMember(ByName(kLayers)));
  verb.add_flag("--contours", words->contours, "Lines of equal value in --false-colour");
  verb.add_option("--reference", words->viewer.reference,
                  "A picture's radiance that --layer lab compares with, .exr")
      ->check(cli::InputFile({core::FileKind::kExrPicture}));
  verb.add_option("--scale", words->scale,
                  "Lowest and highest value of the false colours (default: from the picture)")
      ->expected(2);
  verb.add_option(
      "--read", words->reads,
      "Print what the pixel COLUMN,ROW of the picture says at the end; may be repeated");
  verb.add_option("--view", words->viewer.input.view,
                  "Begin with this [[view]] of the scene (default: its [camera])");
  verb.add_option("--width", words->viewer.input.width,
                  "Picture width instead of the scene's, pixels");
  verb.add_option("--height", words->viewer.input.height,
                  "Picture height instead of the scene's, pixels");
  verb.add_option("--device", words->viewer.input.device,
                  "OpenCL device: a number or a part of its name (default: the first)");
}

}  // namespace luxfield::view
