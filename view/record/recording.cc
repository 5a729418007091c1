#include "luxfield/view/record/recording.h"

#include <fmt/format.h>

#include <functional>
#include <memory>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/outputs.h"
#include "luxfield/core/progress.h"
#include "luxfield/scene/motion_path.h"
#include "luxfield/view/documents/open_input.h"
#include "luxfield/view/record/video_file.h"
#include "luxfield/view/window/screenshot.h"

namespace luxfield::view {
namespace {

constexpr double kAnyTime_s = 1e9;  // so that no picture depends on how fast it is made

LitPicture Lit(LitView& view, bool preview) {
  if (!preview) {
    LitPicture picture;
    do {
      core::ThrowIfInterrupted();
      picture = view.Refine();
    } while (!picture.done);
    return picture;
  }
  return view.Quick();
}

// What depends on the picture, of the first one.
void Fix(const render::Frame& frame, Look& look) {
  if (!look.average) look.average = MeanLuminance(frame.radiance);
  if (look.tone == Tone::kFalseColour && !look.scale) look.scale = ScaleOf(frame, look);
}

class Recorder {
 public:
  explicit Recorder(const RecordOptions& options)
      : options_(options),
        path_(scene::ReadMotionPath(options.path)),
        scene_(LoadScene(options.input, KindToLight(options.input.file))),
        device_(render::Device::Open(options.input.device, options.input.threads)),
        view_(device_, scene_),
        look_(options.look) {
    request_ = RequestOf(scene_, options.input);
    request_.frame_s = kAnyTime_s;
    request_.round_s.reset();
    recording_.width = scene_.camera.width;
    recording_.height = scene_.camera.height;
    recording_.frames_per_s = path_.frames_per_s;
  }

  // Lights every frame and hands it on.
  void Run(const std::function<void(int number, const render::Frame& frame)>& take) {
    const auto placements = scene::PlacementsOf(path_, scene_);
    core::Progress progress("recording", static_cast<std::uint64_t>(path_.frame_count()));
    for (int n = 0; n < path_.frame_count(); ++n) {
      request_.camera = placements[static_cast<std::size_t>(n)].camera;
      request_.lamps = placements[static_cast<std::size_t>(n)].lamps;
      request_.seed = options_.input.seed + static_cast<std::uint64_t>(n);
      view_.Ask(request_);
      if (n == 0 && options_.preview) view_.Quick();  // which knows no speed, and is small
      const LitPicture picture = Lit(view_, options_.preview);
      if (n == 0) Fix(*picture.frame, look_);
      take(n, *picture.frame);
      recording_.frames.push_back({path_.time_s(n), picture.samples, picture.error});
      progress.Advance();
    }
  }

  const Look& look() const { return look_; }
  const Recording& recording() const { return recording_; }

 private:
  const RecordOptions& options_;
  const scene::MotionPath path_;
  const scene::Scene scene_;
  const render::Device device_;
  LitView view_;
  LitRequest request_;
  Look look_;
  Recording recording_;
};

Recording RecordFolder(const RecordOptions& options) {
  if (std::filesystem::exists(options.output) && !std::filesystem::is_directory(options.output))
    throw InputError(options.output.string(), "is a file", "name a folder, or a video");
  Recorder recorder(options);
  recorder.Run([&](int number, const render::Frame& frame) {
    if (number == 0) core::MakeFolder(options.output);  // not for a path that cannot be shown
    const auto name = [&](const char* ending) {
      return options.output / fmt::format("frame_{:04}{}", number, ending);
    };
    render::WriteFrame(name(".exr"), frame);
    WriteScreenshot(name(".png"), {{frame.width, frame.height}, ColoursOf(frame, recorder.look())});
    core::PutOutputsInPlace();
  });
  return recorder.recording();
}

Recording RecordVideo(const RecordOptions& options) {
  Recorder recorder(options);
  core::WriteAtomically(options.output, [&](const std::filesystem::path& temporary) {
    const Recording& recording = recorder.recording();
    VideoFile video(temporary, recording.width, recording.height, recording.frames_per_s);
    recorder.Run(
        [&](int, const render::Frame& frame) { video.Add(ColoursOf(frame, recorder.look())); });
    video.Finish();
  });
  return recorder.recording();
}

}  // namespace

Recording Record(const RecordOptions& options) {
  if (IsVideoName(options.output)) return RecordVideo(options);
  if (options.output.has_extension())
    throw InputError(options.output.string(), "is neither a folder nor a video",
                     "name a folder, or a .mp4, .mkv, .mov or .webm");
  return RecordFolder(options);
}

}  // namespace luxfield::view
