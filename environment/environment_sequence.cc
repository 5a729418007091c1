#include "luxfield/environment/environment_sequence.h"

#include <fmt/format.h>

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>
#include <utility>

#include "luxfield/core/error.h"
#include "luxfield/core/execution.h"
#include "luxfield/core/file.h"
#include "luxfield/core/printable.h"
#include "luxfield/environment/environment_map.h"
#include "luxfield/environment/environment_resampling.h"

namespace luxfield::environment {
namespace {

bool IsDigit(char c) { return c >= '0' && c <= '9'; }

bool IsFrame(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return extension == ".hdr" || extension == ".rgbe" || extension == ".pic" || extension == ".exr";
}

std::vector<std::filesystem::path> FramesOfFolder(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> frames;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.is_regular_file() && IsFrame(entry.path())) frames.push_back(entry.path());
  std::sort(frames.begin(), frames.end(), [](const auto& a, const auto& b) {
    return NaturallyBefore(a.filename().string(), b.filename().string());
  });
  if (frames.empty())
    throw InputError(folder.string(), "holds no frames of an environment",
                     "a sequence is a folder of .hdr or .exr files");
  return frames;
}

std::vector<std::filesystem::path> FramesOfList(const std::filesystem::path& list) {
  std::vector<std::filesystem::path> frames;
  std::istringstream text(core::ReadFile(list));
  int number = 0;
  for (std::string line; std::getline(text, line);) {
    ++number;
    const auto first = line.find_first_not_of(" \t\r"), last = line.find_last_not_of(" \t\r");
    if (first == std::string::npos || line[first] == '#') continue;
    const std::string path = line.substr(first, last - first + 1);
    const auto frame = list.parent_path() / path;
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(frame, ignored))
      throw InputError(
          list.string(),
          fmt::format("line {} names '{}', which is no file", number, core::Printable(path)),
          "a list of environment frames holds a path a line, relative to it; other "
          "text luxfield does not read, rays only as .TM25RAY, .dat, .sdf or .ray");
    frames.push_back(frame);
  }
  if (frames.empty()) throw InputError(list.string(), "names no frames", "write a path a line");
  return frames;
}

}  // namespace

bool NaturallyBefore(std::string_view a, std::string_view b) {
  const std::string_view whole_a = a, whole_b = b;
  while (!a.empty() && !b.empty()) {
    if (!IsDigit(a[0]) || !IsDigit(b[0])) {
      if (a[0] != b[0]) return a[0] < b[0];
      a.remove_prefix(1), b.remove_prefix(1);
      continue;
    }
    const auto number = [](std::string_view& text) {
      const auto end = std::find_if_not(text.begin(), text.end(), IsDigit) - text.begin();
      std::string_view digits = text.substr(0, end);
      text.remove_prefix(end);
      digits.remove_prefix(std::min(digits.find_first_not_of('0'), digits.size()));
      return digits;
    };
    const std::string_view m = number(a), n = number(b);
    if (m.size() != n.size()) return m.size() < n.size();
    if (m != n) return m < n;
  }
  if (a.empty() && b.empty()) return whole_a < whole_b;
  return a.empty();
}

bool IsEnvironmentSequence(const std::filesystem::path& path) {
  return std::filesystem::is_directory(path) || path.extension() == ".txt";
}

std::vector<std::filesystem::path> ListEnvironmentFrames(const std::filesystem::path& path) {
  return std::filesystem::is_directory(path) ? FramesOfFolder(path) : FramesOfList(path);
}

struct EnvironmentSequence::Impl {
  std::vector<std::filesystem::path> frames;
  EnvironmentSequenceOptions options;
  EnvironmentLayout layout;
  TexelRegistration registration;
  std::unique_ptr<const CubeResampler> resampler;

  // The reader's side and the caller's meet in `ready`, frames in their order.
  struct Ready {
    CubeMap cube;
    std::exception_ptr error;
  };
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<Ready> ready;
  std::size_t first = 0;  // that the reader reads
  std::size_t next = 0;   // to be handed out
  bool stop = false;
  std::thread reader;

  ~Impl() { Stop(); }

  void Start() {
    reader = std::thread(core::InThisExecution([this] { ReadAll(); }));
  }

  void Stop() {
    {
      const std::lock_guard lock(mutex);
      stop = true;
    }
    changed.notify_all();
    if (reader.joinable()) reader.join();
    ready.clear();
    stop = false;
  }

  CubeMap Read(const std::filesystem::path& path) const {
    const EnvironmentPicture picture = ReadEnvironmentPicture(path, options.layout);
    if (picture.image.width != resampler->width() || picture.image.height != resampler->height() ||
        picture.layout != layout || picture.registration != registration)
      throw InputError(
          path.string(),
          fmt::format("is {} x {} pixels of {}, the first frame {} x {} of {}{}",
                      picture.image.width, picture.image.height,
                      EnvironmentLayoutName(picture.layout), resampler->width(),
                      resampler->height(), EnvironmentLayoutName(layout),
                      picture.registration == registration ? ""
                                                           : ", with an envmap attribute or "
                                                             "without"),
          "the frames of a sequence must agree: convert or remove it");
    return (*resampler)(picture.image);
  }

  void ReadAll() {
    for (std::size_t n = first; n < frames.size(); ++n) {
      Ready frame;
      try {
        frame.cube = Read(frames[n]);
      } catch (...) {
        frame.error = std::current_exception();
      }
      std::unique_lock lock(mutex);
      changed.wait(lock, [this] { return stop || int(ready.size()) < options.read_ahead; });
      if (stop) return;
      const bool failed = frame.error != nullptr;
      ready.push_back(std::move(frame));
      changed.notify_all();
      if (failed) return;
    }
  }
};

EnvironmentSequence::EnvironmentSequence(const std::filesystem::path& path,
                                         const EnvironmentSequenceOptions& options)
    : impl_(std::make_unique<Impl>()) {
  if (options.read_ahead < 1)
    throw InputError(
        fmt::format("a sequence reads {} frames ahead; give at least 1", options.read_ahead));
  impl_->frames = ListEnvironmentFrames(path);
  impl_->options = options;
  const EnvironmentPicture first = ReadEnvironmentPicture(impl_->frames.front(), options.layout);
  const core::Image& image = first.image;
  impl_->layout = first.layout;
  impl_->registration = first.registration;
  const int face_size =
      options.face_size == 0 ? DefaultFaceSize(first.layout, image.width) : options.face_size;
  impl_->resampler = std::make_unique<CubeResampler>(first.layout, first.registration, image.width,
                                                     image.height, face_size);
  impl_->Start();
}

EnvironmentSequence::~EnvironmentSequence() = default;
EnvironmentSequence::EnvironmentSequence(EnvironmentSequence&&) noexcept = default;
EnvironmentSequence& EnvironmentSequence::operator=(EnvironmentSequence&&) noexcept = default;

const std::vector<std::filesystem::path>& EnvironmentSequence::frames() const {
  return impl_->frames;
}
EnvironmentLayout EnvironmentSequence::layout() const { return impl_->layout; }
int EnvironmentSequence::width() const { return impl_->resampler->width(); }
int EnvironmentSequence::height() const { return impl_->resampler->height(); }
int EnvironmentSequence::face_size() const { return impl_->resampler->face_size(); }

bool EnvironmentSequence::Next(CubeMap& cube) {
  std::unique_lock lock(impl_->mutex);
  if (impl_->next == impl_->frames.size()) return false;
  impl_->changed.wait(lock, [this] { return !impl_->ready.empty(); });
  if (impl_->ready.front().error) std::rethrow_exception(impl_->ready.front().error);
  cube = std::move(impl_->ready.front().cube);
  impl_->ready.pop_front();
  ++impl_->next;
  impl_->changed.notify_all();
  return true;
}

void EnvironmentSequence::Rewind(std::size_t frame) {
  impl_->Stop();
  impl_->first = impl_->next = frame;
  impl_->Start();
}

}  // namespace luxfield::environment
