#include "luxfield/hal/drivers/gphoto2/gphoto2_camera.h"

#if LUXFIELD_GPHOTO2

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "luxfield/core/printable.h"
#include "luxfield/hal/drivers/gphoto2/decoder_process.h"
#include "luxfield/hal/drivers/gphoto2/library.h"
#include "luxfield/hal/drivers/gphoto2/shutter_speed.h"
#include "luxfield/hal/error.h"

namespace luxfield::hal::gphoto2 {
namespace {

constexpr double kOpen_s = 30;  // a camera that wakes up, and its settings
constexpr double kClose_s = 5;
constexpr double kSetting_s = 5;                  // until a setting reads back
constexpr double kAgain_s = 0.05;                 // until a busy camera is asked again
constexpr double kLate_s = 5;                     // a file may come after it was due
constexpr double kDecode_s = 20;                  // until a file is given up
constexpr int kEvent_ms = 20;                     // how often a waiting exposure looks for an abort
constexpr std::size_t kMostAttached = 32u << 20;  // bytes of previews and notes in a file
// Marked speeds against the EXIF's: 1/60 is 1/64, and cameras write one or the other.
constexpr double kMarkedAgainstTrue = 1.15;

// libgphoto2 2.5.30 closes descriptor 0 with a camera on the network: the next file that the
// program opens would take its place, and be closed with the next camera.
class KeepStandardInput {
 public:
  KeepStandardInput() : copy_(fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, STDERR_FILENO + 1)) {}
  ~KeepStandardInput() {
    if (copy_ < 0) return;
    // The lowest free descriptor: 0, if it is free.
    if (const int again = fcntl(copy_, F_DUPFD, STDIN_FILENO); again > 0) close(again);
    close(copy_);
  }
  KeepStandardInput(const KeepStandardInput&) = delete;
  KeepStandardInput& operator=(const KeepStandardInput&) = delete;

 private:
  int copy_;
};

// The library writes to closed sockets: the signal of that, which would end the program, is kept
// from this thread, and taken.
class NoPipeSignal {
 public:
  NoPipeSignal() {
    sigemptyset(&pipe_);
    sigaddset(&pipe_, SIGPIPE);
    pthread_sigmask(SIG_BLOCK, &pipe_, &before_);
  }
  ~NoPipeSignal() {
    constexpr timespec kAtOnce{};
    if (!sigismember(&before_, SIGPIPE)) sigtimedwait(&pipe_, nullptr, &kAtOnce);
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  NoPipeSignal(const NoPipeSignal&) = delete;
  NoPipeSignal& operator=(const NoPipeSignal&) = delete;

 private:
  sigset_t pipe_, before_;
};

}  // namespace

// All that calls use, so that one that hangs may outlive the camera object.
class Gphoto2Camera::Session {
 public:
  Session(const Gphoto2Options& options, std::shared_ptr<core::Clock> clock)
      : name(options.port.empty() ? "camera" : options.port),
        options_(options),
        clock_(std::move(clock)),
        context_(gp_context_new()) {
    gp_context_set_cancel_func(
        context_.get(),
        [](GPContext*, void* session) {
          return static_cast<Session*>(session)->aborted ? GP_CONTEXT_FEEDBACK_CANCEL
                                                         : GP_CONTEXT_FEEDBACK_OK;
        },
        this);
  }
  ~Session() { Close(); }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  CameraCapabilities Open(double deadline_s);
  double SetExposure(double exposure_s, double deadline_s);
  Frame Expose(double exposure_s, double deadline_s);
  void Close();

  std::string name, firmware;
  std::atomic<bool> aborted = false;

 private:
  struct Place {
    std::string folder, file;
  };

  void Require(int result, const std::string& operation) const {
    if (result >= GP_OK) return;
    // An error without a name may be a cable.
    throw Failed(result == GP_ERROR && !Answers() ? GP_ERROR_IO : result, name, operation);
  }
  // Repeats `call` while the camera says that it is busy.
  template <typename Call>
  void Insist(const std::string& operation, double deadline_s, Call call);
  bool Answers() const {
    CameraText text;
    return camera_ && gp_camera_get_summary(camera_, &text, context_.get()) >= GP_OK;
  }
  void ThrowIfOver(const std::string& operation, double deadline_s) const;
  void Connect();
  void CatchUp(double deadline_s);
  OwnedWidget Setting(const std::string& key);
  std::string Told(const char* key);
  void Set(const std::string& key, const std::string& value, double deadline_s);
  std::pair<CameraEventType, std::optional<Place>> NextEvent(int wait_ms);
  Place WaitForFile(double deadline_s);
  // Bounds of what a file may say of itself, before memory is taken for it.
  std::size_t MostPixels() const {  // masked borders included, which are a few per cent
    return 2 * static_cast<std::size_t>(options_.width) * options_.height;
  }
  std::size_t MostBytes() const { return 4 * MostPixels() + kMostAttached; }
  void RequireSize(const Place& place) const;
  std::string Download(const Place& place);
  RawFile Checked(const std::string& bytes, double exposure_s) const;

  Gphoto2Options options_;
  std::shared_ptr<core::Clock> clock_;
  OwnedContext context_;
  ::Camera* camera_ = nullptr;
  std::vector<ShutterSpeed> speeds_;
  std::string last_file_;               // its bytes
  std::optional<double> owed_until_s_;  // a file of a trigger that was given up comes by then
};

void Gphoto2Camera::Session::ThrowIfOver(const std::string& operation, double deadline_s) const {
  if (aborted)
    throw HardwareError(Fault::kStopped, name, operation, "was stopped", "resume the session");
  if (clock_->MonotonicSeconds() >= deadline_s)
    throw HardwareError(Fault::kTimeout, name, operation, "has not ended by its deadline",
                        "check the camera's display, then resume");
}

template <typename Call>
void Gphoto2Camera::Session::Insist(const std::string& operation, double deadline_s, Call call) {
  for (;;) {
    const int result = call();
    if (!Busy(result)) return Require(result, operation);
    ThrowIfOver(operation, deadline_s);
    clock_->SleepSeconds(kAgain_s);
  }
}

void Gphoto2Camera::Session::Connect() {
  std::string port = options_.port, model = "PTP/IP Camera";
  if (!port.starts_with("ptpip:")) {
    const OwnedList found = DetectedCameras(context_.get());
    const int count = gp_list_count(found.get());
    int take = -1;
    for (int k = 0; k < count; ++k)
      if (port.empty() ? count == 1 : PortOf(found.get(), k) == port) take = k;
    if (take < 0)
      throw HardwareError(
          Fault::kDisconnected, name, "open",
          count == 0 ? std::string("no camera is on USB")
                     : fmt::format("{} cameras are on USB, none of them chosen", count),
          "check cable and power; `luxfield devices` lists the ports for camera.port");
    port = PortOf(found.get(), take);
    model = ModelOf(found.get(), take);
    if (const auto refusal = RefusalOf(port)) throw *refusal;
  }
  Require(gp_camera_new(&camera_), "open");
  CameraAbilitiesList* models = nullptr;
  Require(gp_abilities_list_new(&models), "open");
  const OwnedModels owned_models(models);
  Require(gp_abilities_list_load(models, context_.get()), "open");
  const int model_index = gp_abilities_list_lookup_model(models, model.c_str());
  Require(model_index, "open");
  CameraAbilities abilities;
  Require(gp_abilities_list_get_abilities(models, model_index, &abilities), "open");
  Require(gp_camera_set_abilities(camera_, abilities), "open");
  GPPortInfoList* ports = nullptr;
  Require(gp_port_info_list_new(&ports), "open");
  const OwnedPorts owned_ports(ports);
  Require(gp_port_info_list_load(ports), "open");
  const int port_index = gp_port_info_list_lookup_path(ports, port.c_str());
  Require(port_index, "open");
  GPPortInfo info;
  Require(gp_port_info_list_get_info(ports, port_index, &info), "open");
  Require(gp_camera_set_port_info(camera_, info), "open");
  Require(gp_camera_init(camera_, context_.get()), "open");
  name = model;
}

OwnedWidget Gphoto2Camera::Session::Setting(const std::string& key) {
  CameraWidget* widget = nullptr;
  const int result = gp_camera_get_single_config(camera_, key.c_str(), &widget, context_.get());
  if (result == GP_ERROR_NOT_SUPPORTED || result == GP_ERROR_BAD_PARAMETERS)
    throw HardwareError(Fault::kRefused, name, "configure",
                        fmt::format("the camera has no setting \"{}\"", key),
                        "`gphoto2 --list-config` lists those it has");
  Require(result, "configure");
  return OwnedWidget(widget);
}

// What the camera says of itself; empty: nothing.
std::string Gphoto2Camera::Session::Told(const char* key) {
  CameraWidget* widget = nullptr;
  if (gp_camera_get_single_config(camera_, key, &widget, context_.get()) < GP_OK) return {};
  return core::Printable(TextOf(OwnedWidget(widget).get()).value_or(""));
}

// Cameras take a setting when they like: it is set again until it reads back.
void Gphoto2Camera::Session::Set(const std::string& key, const std::string& value,
                                 double deadline_s) {
  const double end_s = std::min(deadline_s, clock_->MonotonicSeconds() + kSetting_s);
  std::optional<std::string> now;
  do {
    const OwnedWidget widget = Setting(key);
    now = TextOf(widget.get());
    if (now == value) return;
    if (!now)
      throw HardwareError(Fault::kRefused, name, "configure",
                          fmt::format("\"{}\" is no choice and no text", key),
                          "set it at the camera");
    const auto choices = ChoicesOf(widget.get());
    if (!choices.empty() && std::find(choices.begin(), choices.end(), value) == choices.end())
      throw HardwareError(Fault::kRefused, name, "configure",
                          fmt::format("\"{}\" cannot be \"{}\"; it can be {}", key, value,
                                      fmt::join(choices, ", ")),
                          "choose one of them, or turn the camera's dial to manual");
    Require(gp_widget_set_value(widget.get(), value.c_str()), "configure");
    Insist("configure", deadline_s, [&] {
      return gp_camera_set_single_config(camera_, key.c_str(), widget.get(), context_.get());
    });
    now = TextOf(Setting(key).get());
    if (now == value) return;
    clock_->SleepSeconds(kAgain_s);
  } while (clock_->MonotonicSeconds() < end_s);
  throw HardwareError(
      Fault::kRefused, name, "configure",
      fmt::format("\"{}\" was set to \"{}\" and reads back \"{}\"", key, value, now.value_or("")),
      "turn the camera's dial to manual, switch off automatic ISO and power saving");
}

CameraCapabilities Gphoto2Camera::Session::Open(double deadline_s) {
  // Blocked in this thread, which makes all calls: the library writes to closed sockets.
  sigset_t pipe;
  sigemptyset(&pipe);
  sigaddset(&pipe, SIGPIPE);
  pthread_sigmask(SIG_BLOCK, &pipe, nullptr);
  Connect();
  for (const char* key : {"cameramodel", "serialnumber"})
    if (const std::string text = Told(key); !text.empty()) name += " " + text;
  firmware = Told("deviceversion");
  CameraCapabilities capabilities;
  for (const auto& [key, value] : options_.settings) {
    Set(key, value, deadline_s);
    auto choices = ChoicesOf(Setting(key).get());
    if (!choices.empty()) capabilities.choices["setting " + key] = std::move(choices);
  }
  speeds_ = ShutterSpeeds(ChoicesOf(Setting(options_.shutter_speed).get()));
  if (speeds_.empty())
    throw HardwareError(Fault::kRefused, name, "open",
                        fmt::format("\"{}\" has no shutter speeds", options_.shutter_speed),
                        "turn the camera's dial to manual, or name the setting that has them in "
                        "camera.shutter_speed");
  capabilities.width = options_.width;
  capabilities.height = options_.height;
  capabilities.bits = options_.bits;
  capabilities.min_exposure_s = speeds_.front().exposure_s;
  capabilities.max_exposure_s = speeds_.back().exposure_s;
  for (const ShutterSpeed& speed : speeds_) capabilities.exposures_s.push_back(speed.exposure_s);
  capabilities.readout_s = options_.readout_s;
  return capabilities;
}

double Gphoto2Camera::Session::SetExposure(double exposure_s, double deadline_s) {
  const auto speed = std::find_if(speeds_.begin(), speeds_.end(), [&](const ShutterSpeed& s) {
    return std::abs(s.exposure_s - exposure_s) <= 1e-6 * exposure_s;
  });
  if (speed == speeds_.end())
    throw HardwareError(Fault::kOutOfRange, name, "configure",
                        fmt::format("{} s is none of the camera's shutter speeds", exposure_s),
                        "`luxfield devices LAB` lists them");
  Set(options_.shutter_speed, speed->text, deadline_s);
  return speed->exposure_s;
}

// Files that a trigger before this one, or a finger, has left: they are not the frame to come.
void Gphoto2Camera::Session::CatchUp(double deadline_s) {
  for (;;) {
    ThrowIfOver("expose", deadline_s);
    const auto [event, place] = NextEvent(1);
    if (place) {
      Require(gp_camera_file_delete(camera_, place->folder.c_str(), place->file.c_str(),
                                    context_.get()),
              "delete");
      owed_until_s_.reset();
    }
    const bool owed = owed_until_s_ && clock_->MonotonicSeconds() < *owed_until_s_;
    if (event == GP_EVENT_TIMEOUT && !owed) break;
  }
  owed_until_s_.reset();
}

// What the camera says within the time, and of a new file where it is.
std::pair<CameraEventType, std::optional<Gphoto2Camera::Session::Place>>
Gphoto2Camera::Session::NextEvent(int wait_ms) {
  CameraEventType type{};
  void* data = nullptr;
  const int result = gp_camera_wait_for_event(camera_, wait_ms, &type, &data, context_.get());
  std::optional<Place> place;
  if (result == GP_OK && type == GP_EVENT_FILE_ADDED) {
    const auto* path = static_cast<const CameraFilePath*>(data);
    place = Place{path->folder, path->name};
  }
  std::free(data);
  Require(result, "expose");
  return {type, place};
}

Gphoto2Camera::Session::Place Gphoto2Camera::Session::WaitForFile(double deadline_s) {
  for (;;) {
    ThrowIfOver("expose", deadline_s);
    if (const auto place = NextEvent(kEvent_ms).second) return *place;
  }
}

void Gphoto2Camera::Session::RequireSize(const Place& place) const {
  CameraFileInfo info{};
  Require(gp_camera_file_get_info(camera_, place.folder.c_str(), place.file.c_str(), &info,
                                  context_.get()),
          "download");
  if ((info.file.fields & GP_FILE_INFO_SIZE) && info.file.size > MostBytes())
    throw HardwareError(Fault::kProtocol, name, "download",
                        fmt::format("a file of {} bytes came, {} x {} pixels take {} at most",
                                    info.file.size, options_.width, options_.height, MostBytes()),
                        "correct camera.size_px in lab.toml, or set the camera to RAW");
}

std::string Gphoto2Camera::Session::Download(const Place& place) {
  RequireSize(place);
  CameraFile* file = nullptr;
  Require(gp_file_new(&file), "download");
  const OwnedFile owned(file);
  Require(gp_camera_file_get(camera_, place.folder.c_str(), place.file.c_str(), GP_FILE_TYPE_NORMAL,
                             file, context_.get()),
          "download");
  const char* data = nullptr;
  unsigned long size = 0;
  Require(gp_file_get_data_and_size(file, &data, &size), "download");
  std::string bytes(data, size);
  Require(gp_camera_file_delete(camera_, place.folder.c_str(), place.file.c_str(), context_.get()),
          "delete");
  return bytes;
}

RawFile Gphoto2Camera::Session::Checked(const std::string& bytes, double exposure_s) const {
  if (bytes == last_file_)
    throw HardwareError(Fault::kIncomplete, name, "expose", "the frame before came again",
                        "power-cycle the camera if it goes on");
  RawFile raw = DecodeApart([&] { return DecodeRawFile(bytes, name, MostPixels()); }, name,
                            MostPixels(), kDecode_s);
  const auto not_as_stated = [&](const std::string& problem, const std::string& remedy) {
    return HardwareError(Fault::kProtocol, name, "expose", problem, remedy);
  };
  if (raw.image.width != options_.width || raw.image.height != options_.height)
    throw not_as_stated(
        fmt::format("a frame of {} x {} pixels came, the lab says {} x {}", raw.image.width,
                    raw.image.height, options_.width, options_.height),
        "correct camera.size_px in lab.toml, or the camera's picture size");
  if (raw.cfa != options_.cfa)
    throw not_as_stated(
        fmt::format("the frame's mosaic is \"{}\", the lab says \"{}\"", raw.cfa, options_.cfa),
        "correct camera.mosaic in lab.toml");
  const auto most = *std::max_element(raw.image.dn.begin(), raw.image.dn.end());
  if (most >= 1 << options_.bits)
    throw not_as_stated(
        fmt::format("a pixel of {} came, more than {} bits hold", most, options_.bits),
        "correct camera.bits in lab.toml");
  if (raw.exposure_s > 0 &&
      std::abs(std::log(raw.exposure_s / exposure_s)) > std::log(kMarkedAgainstTrue))
    throw HardwareError(
        Fault::kIncomplete, name, "expose",
        fmt::format("the file says {:.6g} s, set are {:.6g} s", raw.exposure_s, exposure_s),
        "turn the camera's dial to manual");
  return raw;
}

Frame Gphoto2Camera::Session::Expose(double exposure_s, double deadline_s) {
  CatchUp(deadline_s);
  Frame frame;
  Insist("expose", deadline_s, [&] {
    frame.t_start_s = clock_->MonotonicSeconds();  // of the trigger that it takes
    return gp_camera_trigger_capture(camera_, context_.get());
  });
  owed_until_s_ = clock_->MonotonicSeconds() + exposure_s + options_.readout_s + kLate_s;
  const Place place = WaitForFile(deadline_s);
  owed_until_s_.reset();
  std::string bytes = Download(place);
  RawFile raw = Checked(bytes, exposure_s);
  last_file_ = std::move(bytes);
  frame.image = std::move(raw.image);
  frame.temperature_c = raw.temperature_c;
  return frame;
}

void Gphoto2Camera::Session::Close() {
  if (!camera_) return;
  aborted = false;  // the camera is to hear that it is let go
  const KeepStandardInput keep;
  const NoPipeSignal quiet;  // the thread may be that of a constructor which failed
  gp_camera_exit(camera_, context_.get());
  gp_camera_unref(std::exchange(camera_, nullptr));
}

std::vector<Gphoto2Device> ListGphoto2Devices() {
  const OwnedContext context(gp_context_new());
  const OwnedList found = DetectedCameras(context.get());
  std::vector<Gphoto2Device> devices;
  for (int k = 0; k < gp_list_count(found.get()); ++k) {
    const std::string port = PortOf(found.get(), k);
    const auto refusal = RefusalOf(port);
    devices.push_back({port, ModelOf(found.get(), k), refusal ? refusal->what() : ""});
  }
  return devices;
}

Gphoto2Camera::Gphoto2Camera(const Gphoto2Options& options, std::shared_ptr<core::Clock> clock)
    : clock_(std::move(clock)), session_(std::make_shared<Session>(options, clock_)) {
  caller_.emplace(session_->name, clock_);
  const double deadline_s = clock_->MonotonicSeconds() + kOpen_s;
  capabilities_ = caller_->Call(
      "open", deadline_s, [session = session_, deadline_s] { return session->Open(deadline_s); });
  identity_ = session_->name;
  firmware_ = session_->firmware;
}

Gphoto2Camera::~Gphoto2Camera() {
  session_->aborted = true;
  const double give_up_s = clock_->MonotonicSeconds() + kClose_s;
  for (;;) try {
      caller_->Call("close", give_up_s, [session = session_] { session->Close(); });
      return;
    } catch (const HardwareError&) {
      // A call that hangs closes the camera when it ends, should it not do so in time.
      if (clock_->MonotonicSeconds() >= give_up_s) return;
      clock_->SleepSeconds(kAgain_s);
    }
}

AppliedSettings Gphoto2Camera::Configure(const CameraSettings& settings, double deadline_s) {
  session_->aborted = false;
  const double set_s =
      caller_->Call("configure", deadline_s, [session = session_, settings, deadline_s] {
        return session->SetExposure(settings.exposure_s, deadline_s);
      });
  applied_ = {set_s, applied_.settings_epoch + 1};
  return applied_;
}

Frame Gphoto2Camera::Expose(double deadline_s) {
  if (applied_.settings_epoch == 0)
    throw HardwareError(Fault::kRefused, identity_, "expose", "no exposure time was set",
                        "configure it first");
  session_->aborted = false;
  // It gives up by itself a moment before the caller would.
  const double give_up_s = deadline_s - 2e-3 * kEvent_ms;
  Frame frame = caller_->Call("expose", deadline_s,
                              [session = session_, exposure_s = applied_.exposure_s, give_up_s] {
                                return session->Expose(exposure_s, give_up_s);
                              });
  frame.settings = applied_;
  frame.frame_id = ++frames_;
  frame.t_end_s = frame.t_start_s + applied_.exposure_s;
  return frame;
}

void Gphoto2Camera::Abort() { session_->aborted = true; }

}  // namespace luxfield::hal::gphoto2

#endif
