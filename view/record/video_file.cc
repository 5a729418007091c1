#include "luxfield/view/record/video_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <string>
#include <vector>

#include "luxfield/core/error.h"

extern char** environ;

namespace luxfield::view {
namespace {

constexpr std::array kEndings = {".mp4", ".mkv", ".mov", ".webm"};

// What ffmpeg is to do: pictures as they come, with even sides as its coders want them, as video
// that says of itself that it is Rec. 709 with the curve of sRGB.
std::vector<std::string> Words(const std::filesystem::path& path, int width, int height,
                               double frames_per_s) {
  return {"ffmpeg",
          "-loglevel",
          "error",
          "-y",
          "-f",
          "rawvideo",
          "-pixel_format",
          "rgba",
          "-video_size",
          fmt::format("{}x{}", width, height),
          "-framerate",
          fmt::format("{}", frames_per_s),
          "-i",
          "pipe:0",
          "-vf",
          "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv",
          "-pix_fmt",
          "yuv420p",
          "-color_primaries",
          "bt709",
          "-color_trc",
          "iec61966-2-1",
          "-colorspace",
          "bt709",
          "-color_range",
          "tv",
          "file:" + path.string()};
}

// While one lives, a pipe that nobody reads makes write() fail instead of ending the process.
class WithoutBrokenPipe {
 public:
  WithoutBrokenPipe() {
    struct sigaction ignore {};
    ignore.sa_handler = SIG_IGN;
    sigaction(SIGPIPE, &ignore, &before_);
  }
  ~WithoutBrokenPipe() { sigaction(SIGPIPE, &before_, nullptr); }
  WithoutBrokenPipe(const WithoutBrokenPipe&) = delete;
  WithoutBrokenPipe& operator=(const WithoutBrokenPipe&) = delete;

 private:
  struct sigaction before_ {};
};

}  // namespace

bool IsVideoName(const std::filesystem::path& path) {
  return std::ranges::find(kEndings, path.extension().string()) != kEndings.end();
}

VideoFile::VideoFile(const std::filesystem::path& path, int width, int height,
                     double frames_per_s) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw DeviceError("no pipe to ffmpeg; close other programs");
  std::vector<std::string> words = Words(path, width, height, frames_per_s);
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[0], STDIN_FILENO);
  const int failed = posix_spawnp(&ffmpeg_, "ffmpeg", &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[0]);
  pictures_ = ends[1];
  if (failed == 0) return;
  close(pictures_);
  throw DeviceError(
      path.string() +
      ": a video needs the program ffmpeg, which is not there; install it, or name a folder");
}

VideoFile::~VideoFile() {
  if (pictures_ >= 0) close(pictures_);
  if (ffmpeg_ < 0) return;
  kill(ffmpeg_, SIGKILL);
  waitpid(ffmpeg_, nullptr, 0);
}

void VideoFile::Add(std::span<const std::uint8_t> rgba) {
  const WithoutBrokenPipe without;
  while (!rgba.empty()) {
    const ssize_t written = write(pictures_, rgba.data(), rgba.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0)
      throw DeviceError("ffmpeg ended before the last picture; what it says stands above");
    rgba = rgba.subspan(static_cast<std::size_t>(written));
  }
}

void VideoFile::Finish() {
  close(pictures_);
  pictures_ = -1;
  int status = 0;
  while (waitpid(ffmpeg_, &status, 0) < 0 && errno == EINTR) {
  }
  ffmpeg_ = -1;
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw DeviceError("ffmpeg could not make the video; what it says stands above");
}

}  // namespace luxfield::view
