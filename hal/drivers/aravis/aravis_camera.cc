#include "luxfield/hal/drivers/aravis/aravis_camera.h"

#if LUXFIELD_ARAVIS

#include <arv.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <system_error>
#include <tuple>
#include <utility>
#include <vector>

#include "luxfield/core/printable.h"
#include "luxfield/core/spare_descriptors.h"
#include "luxfield/hal/drivers/aravis/camera_features.h"
#include "luxfield/hal/drivers/aravis/device_clock.h"
#include "luxfield/hal/drivers/aravis/pixel_format.h"
#include "luxfield/hal/drivers/aravis/result.h"
#include "luxfield/hal/drivers/aravis/stream_filter.h"
#include "luxfield/hal/error.h"

namespace luxfield::hal::aravis {
namespace {

constexpr double kOpen_s = 20;  // discovery, the camera's description, a dozen registers
constexpr double kHeartbeat_s =
    6;  // a camera that hears nothing from its controller is free after 3
constexpr gulong kAgain_us = 200'000;
constexpr int kBuffers = 4;          // one is filled, the others take what was in flight
constexpr guint64 kPop_us = 20'000;  // how often a waiting exposure looks for an abort
constexpr double kUsPerS = 1e6;
constexpr std::array<unsigned char, 8> kUnwritten = {0x5a, 0xc3, 0x3c, 0xa5,
                                                     0x96, 0x69, 0x0f, 0xf1};
// aravis repeats a command that is not answered within 0.5 s, and a camera that has heard the first
// one exposes twice.
constexpr double kAnswer_s = 0.4;
constexpr double kStray_s = 0.5;  // longer than aravis keeps a frame whose packets are missing

template <typename T>
struct Unref {
  void operator()(T* object) const { g_object_unref(object); }
};
template <typename T>
using Owned = std::unique_ptr<T, Unref<T>>;

// Aravis searches over sockets whose opening it does not test: without descriptors it ends the
// program. A search takes one for each of the network's interfaces, USB's and their pipes.
void RequireDescriptors(const std::string& device) {
  constexpr int kOfASearch = 32;
  const int spare = core::SpareDescriptors(kOfASearch);
  if (spare < kOfASearch)
    throw HardwareError(
        Fault::kRefused, device, "search",
        fmt::format("{} file descriptors are left, a search takes up to {}", spare, kOfASearch),
        "raise the limit of open files (ulimit -n)");
}

}  // namespace

// All that calls use, so that one that hangs may outlive the camera object.
struct AravisCamera::Session {
  std::string name, firmware;
  Owned<ArvCamera> camera;
  Owned<ArvStream> stream;
  std::shared_ptr<hal::Trigger> line;  // null: the camera's own command
  PixelFormat format;
  ArvPixelFormat raw_format = 0;
  Region region;
  guint payload = 0;
  std::atomic<bool> lost = false, aborted = false;
  std::optional<guint64> last_block;
  double exposure_s = 0, readout_s = 0;
  DeviceClock device_clock;
  double stray_until_s = 0;  // until then a frame that nobody waits for may come
  bool has_temperature = false;

  ~Session() {
    if (!camera) return;
    // The device lives on in the library's hands for a moment: it must not call back into here.
    g_signal_handlers_disconnect_by_data(arv_camera_get_device(camera.get()), this);
    if (stream && !lost) arv_camera_stop_acquisition(camera.get(), nullptr);
  }

  void Open(const AravisOptions& options);
  CameraCapabilities SetUp(const AravisOptions& options);
  double SetExposure(double exposure_us);
  Frame Expose(core::Clock& clock, double deadline_s);

 private:
  void Connect(const AravisOptions& options);
  bool Controls() const;
  void Start();
  void FilterStream();
  void Offer(Owned<ArvBuffer> buffer);
  char* EndOf(ArvBuffer* buffer) const;
  void DiscardStrayFrames(core::Clock& clock, double deadline_s);
  void Trigger(core::Clock& clock, double deadline_s);
  void TriggerBySoftware(core::Clock& clock);
  Owned<ArvBuffer> Pop(core::Clock& clock, double deadline_s);
  session::RawFrame Read(ArvBuffer* buffer) const;
};

void AravisCamera::Session::Connect(const AravisOptions& options) {
  Result result(name, "open");
  camera.reset(arv_camera_new(options.id.empty() ? nullptr : options.id.c_str(), result));
  result.ThrowIfFailed();
  if (!camera)
    throw HardwareError(Fault::kDisconnected, name, "open", "no such camera answers", kNotFound);
}

// Whether our writes count; on USB there is nobody else.
bool AravisCamera::Session::Controls() const {
  if (!arv_camera_is_gv_device(camera.get())) return true;
  return arv_gv_device_is_controller(ARV_GV_DEVICE(arv_camera_get_device(camera.get())));
}

void AravisCamera::Session::Open(const AravisOptions& options) {
  // A program that was killed keeps a camera on the network until that misses its heartbeat.
  const auto give_up =
      std::chrono::steady_clock::now() + std::chrono::duration<double>(kHeartbeat_s);
  for (;;) {
    Connect(options);
    if (Controls()) break;
    if (std::chrono::steady_clock::now() >= give_up)
      throw HardwareError(Fault::kRefused, name, "open", "another program controls it",
                          "end the program that controls the camera");
    camera.reset();
    g_usleep(kAgain_us);
  }
  Result result(name, "open");
  // Both live as long as the camera.
  const char* vendor = arv_camera_get_vendor_name(camera.get(), result);
  const char* model = arv_camera_get_model_name(camera.get(), result);
  const char* serial = arv_camera_get_device_serial_number(camera.get(), result);
  const auto text = [](const char* s) { return core::Printable(s ? s : "?"); };
  name = fmt::format("{} {} {}", text(vendor), text(model), text(serial));
  firmware = Firmware(camera.get());
  g_signal_connect(arv_camera_get_device(camera.get()), "control-lost",
                   G_CALLBACK(+[](ArvDevice*, gpointer session) {
                     static_cast<Session*>(session)->lost = true;
                   }),
                   this);
}

CameraCapabilities AravisCamera::Session::SetUp(const AravisOptions& options) {
  // What a killed program has left going: its frames go elsewhere, and settings may be locked.
  arv_camera_stop_acquisition(camera.get(), nullptr);
  Result result(name, "set up");
  format = SetPixelFormat(camera.get(), name, options.pixel_format);
  raw_format = arv_camera_get_pixel_format(camera.get(), result);
  result.ThrowIfFailed();
  has_temperature = arv_camera_is_feature_available(camera.get(), "DeviceTemperature", nullptr);
  if (arv_camera_is_exposure_auto_available(camera.get(), nullptr)) {
    arv_camera_set_exposure_time_auto(camera.get(), ARV_AUTO_OFF, result);
    result.ThrowIfFailed();
  }
  if (arv_camera_is_gain_auto_available(camera.get(), nullptr)) {
    arv_camera_set_gain_auto(camera.get(), ARV_AUTO_OFF, result);
    result.ThrowIfFailed();
  }
  if (arv_camera_are_chunks_available(camera.get(), nullptr)) {  // a frame is its pixels alone
    arv_camera_set_chunk_mode(camera.get(), false, result);
    result.ThrowIfFailed();
  }
  CameraCapabilities capabilities;
  std::tie(capabilities.min_gain_db, capabilities.max_gain_db) =
      SetGain(camera.get(), name, options.gain_db);
  capabilities.choices["pixel_format"] = PixelFormats(camera.get());
  region = SetRegion(camera.get(), name, options.region);
  capabilities.width = region.width;
  capabilities.height = region.height;
  capabilities.bits = format.bits;
  capabilities.readout_s = readout_s = options.readout_s;
  const auto [least_us, most_us] = Agreed(name, "set up", [this](GError** error) {
    std::pair<double, double> bounds;
    arv_camera_get_exposure_time_bounds(camera.get(), &bounds.first, &bounds.second, error);
    return bounds;
  });
  capabilities.min_exposure_s = least_us / kUsPerS;
  capabilities.max_exposure_s = most_us / kUsPerS;
  // Cameras without a step say a tiny number.
  const double step_us = arv_camera_get_float_increment(camera.get(), "ExposureTime", nullptr);
  if (step_us > 1e-3 && step_us < most_us) capabilities.exposure_step_s = step_us / kUsPerS;

  // No filter of ours reaches a packet socket.
  if (arv_camera_is_gv_device(camera.get()))
    arv_camera_gv_set_stream_options(camera.get(), ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  arv_camera_set_acquisition_mode(camera.get(), ARV_ACQUISITION_MODE_CONTINUOUS, result);
  result.ThrowIfFailed();
  SetTrigger(camera.get(), name, options.line_trigger);
  Start();
  return capabilities;
}

void AravisCamera::Session::Start() {
  Result result(name, "start");
  stream.reset(arv_camera_create_stream(camera.get(), nullptr, nullptr, result));
  result.ThrowIfFailed();
  if (!stream)
    throw HardwareError(Fault::kProtocol, name, "start", "the camera gives no stream",
                        "reconnect the camera");
  payload = Agreed(name, "start",
                   [this](GError** error) { return arv_camera_get_payload(camera.get(), error); });
  if (arv_camera_is_gv_device(camera.get())) FilterStream();
  for (int k = 0; k < kBuffers; ++k) Offer(Owned<ArvBuffer>(arv_buffer_new_allocate(payload)));
  arv_camera_start_acquisition(camera.get(), result);
  result.ThrowIfFailed();
}

void AravisCamera::Session::FilterStream() {
  const guint packet_size = Agreed(name, "start", [this](GError** error) {
    return arv_camera_gv_get_packet_size(camera.get(), error);
  });
  constexpr guint kHeaders = 48;
  if (payload == 0 || packet_size <= kHeaders)
    throw HardwareError(
        Fault::kProtocol, name, "start",
        fmt::format("frames of {} bytes cannot come in packets of {} bytes", payload, packet_size),
        "power-cycle the camera");
  auto* device = ARV_GV_DEVICE(arv_camera_get_device(camera.get()));
  const guint8* ip = g_inet_address_to_bytes(g_inet_socket_address_get_address(
      G_INET_SOCKET_ADDRESS(arv_gv_device_get_device_address(device))));
  const auto camera_ip = static_cast<std::uint32_t>(ip[0] << 24 | ip[1] << 16 | ip[2] << 8 | ip[3]);
  try {
    AttachToPort(arv_gv_stream_get_port(ARV_GV_STREAM(stream.get())),
                 FrameFilter({camera_ip, packet_size, payload}));
  } catch (const std::system_error& error) {
    throw HardwareError(Fault::kRefused, name, "start",
                        fmt::format("damaged packets cannot be kept out: {}", error.what()),
                        "use a kernel with socket filters");
  }
}

double AravisCamera::Session::SetExposure(double exposure_us) {
  Result result(name, "configure");
  arv_camera_set_exposure_time(camera.get(), exposure_us, result);
  result.ThrowIfFailed();
  const double set_us = Agreed(name, "configure", [this](GError** error) {
    return arv_camera_get_exposure_time(camera.get(), error);
  });
  exposure_s = set_us / kUsPerS;
  return set_us;
}

Frame AravisCamera::Session::Expose(core::Clock& clock, double deadline_s) {
  Result result(name, "expose");
  DiscardStrayFrames(clock, deadline_s);
  const double sent_s = clock.MonotonicSeconds();
  Trigger(clock, deadline_s);
  Owned<ArvBuffer> buffer = Pop(clock, deadline_s);
  const double received_s = clock.MonotonicSeconds();
  const ArvBufferStatus status = arv_buffer_get_status(buffer.get());
  const guint64 block = arv_buffer_get_frame_id(buffer.get());
  const bool fresh = block != last_block;
  last_block = block;
  const auto incomplete = [this](const std::string& problem) {
    return HardwareError(
        Fault::kIncomplete, name, "expose", problem,
        "use a network of the camera's own, with jumbo frames and a large receive buffer");
  };
  if (status != ARV_BUFFER_STATUS_SUCCESS || !fresh) {
    Offer(std::move(buffer));
    throw incomplete(status == ARV_BUFFER_STATUS_SUCCESS ? fmt::format("frame {} came again", block)
                     : status == ARV_BUFFER_STATUS_SIZE_MISMATCH
                         ? std::string("the frame is larger than the camera said")
                         : std::string("packets of the frame were lost and not sent again"));
  }
  Frame frame;
  frame.t_start_s =
      device_clock.StartOf(arv_buffer_get_timestamp(buffer.get()), sent_s, received_s - exposure_s);
  frame.t_end_s = frame.t_start_s + exposure_s;
  try {
    frame.image = Read(buffer.get());
  } catch (const InputError& error) {  // packets that are too short pass for a whole frame
    Offer(std::move(buffer));
    throw incomplete(error.what());
  }
  Offer(std::move(buffer));
  stray_until_s = 0;
  frame.temperature_c = std::numeric_limits<double>::quiet_NaN();
  if (has_temperature) {  // only reported: the frame is good without it
    const double read_c = arv_camera_get_float(camera.get(), "DeviceTemperature", result);
    if (!result.failed()) frame.temperature_c = read_c;
  }
  return frame;
}

// To be filled. Its end is marked: aravis asks the camera for the packet size once, and what it
// takes for a smaller one moves all pixels after the first packet.
void AravisCamera::Session::Offer(Owned<ArvBuffer> buffer) {
  if (char* end = EndOf(buffer.get())) std::memcpy(end, kUnwritten.data(), kUnwritten.size());
  arv_stream_push_buffer(stream.get(), buffer.release());
}

// Where the mark stands; null where there are no packets, or no room.
char* AravisCamera::Session::EndOf(ArvBuffer* buffer) const {
  if (!arv_camera_is_gv_device(camera.get()) || payload < kUnwritten.size()) return nullptr;
  std::size_t size = 0;  // of what was received, not of the buffer
  const void* data = arv_buffer_get_data(buffer, &size);
  return static_cast<char*>(const_cast<void*>(data)) + payload - kUnwritten.size();
}

// After an exposure that failed its frame, or a second one, may still come: it would pass for that
// of the next.
void AravisCamera::Session::DiscardStrayFrames(core::Clock& clock, double deadline_s) {
  const double until_s = std::min(stray_until_s, deadline_s);
  while (clock.MonotonicSeconds() < until_s && !lost && !aborted)
    if (ArvBuffer* buffer = arv_stream_timeout_pop_buffer(stream.get(), kPop_us))
      Offer(Owned<ArvBuffer>(buffer));
  while (ArvBuffer* buffer = arv_stream_try_pop_buffer(stream.get()))
    Offer(Owned<ArvBuffer>(buffer));
}

// However it ends, the camera may have heard it.
void AravisCamera::Session::Trigger(core::Clock& clock, double deadline_s) {
  struct Stray {
    Session& session;
    core::Clock& clock;
    ~Stray() {
      session.stray_until_s =
          clock.MonotonicSeconds() + session.exposure_s + session.readout_s + kStray_s;
    }
  } const stray{*this, clock};
  if (line)
    line->Pulse(deadline_s);
  else
    TriggerBySoftware(clock);
}

void AravisCamera::Session::TriggerBySoftware(core::Clock& clock) {
  Result result(name, "expose");
  const double asked_s = clock.MonotonicSeconds();
  arv_camera_software_trigger(camera.get(), result);
  const double answered_s = clock.MonotonicSeconds();
  result.ThrowIfFailed();
  if (answered_s - asked_s > kAnswer_s)
    throw HardwareError(Fault::kIncomplete, name, "expose",
                        "the answer to the trigger was late: it may have exposed twice",
                        "use a network of the camera's own");
}

Owned<ArvBuffer> AravisCamera::Session::Pop(core::Clock& clock, double deadline_s) {
  for (;;) {
    if (ArvBuffer* buffer = arv_stream_timeout_pop_buffer(stream.get(), kPop_us))
      return Owned<ArvBuffer>(buffer);
    if (lost)
      throw HardwareError(Fault::kDisconnected, name, "expose", "the camera stopped answering",
                          "check cable and power, then resume");
    if (aborted)
      throw HardwareError(Fault::kStopped, name, "expose", "was stopped", "resume the session");
    if (clock.MonotonicSeconds() >= deadline_s)
      throw HardwareError(Fault::kTimeout, name, "expose", "no frame came by the deadline",
                          line ? "check the wire of " + line->identity() +
                                     ", camera.trigger_source and the network, then resume"
                               : "check the network, then resume");
  }
}

session::RawFrame AravisCamera::Session::Read(ArvBuffer* buffer) const {
  if (const ArvPixelFormat sent = arv_buffer_get_image_pixel_format(buffer); sent != raw_format)
    throw HardwareError(
        Fault::kProtocol, name, "expose",
        fmt::format("a frame of pixel format 0x{:08x} came, not {}", sent, format.name),
        "end other programs that change the camera's settings");
  std::size_t size = 0;
  const auto* data = static_cast<const std::uint8_t*>(arv_buffer_get_image_data(buffer, &size));
  int x_padding = 0, y_padding = 0;
  arv_buffer_get_image_padding(buffer, &x_padding, &y_padding);
  const int width = arv_buffer_get_image_width(buffer),
            height = arv_buffer_get_image_height(buffer);
  if (width != region.width || height != region.height)
    throw HardwareError(Fault::kProtocol, name, "expose",
                        fmt::format("a frame of {} x {} pixels came, not of {} x {}", width, height,
                                    region.width, region.height),
                        "end other programs that change the camera's settings");
  if (const char* end = EndOf(buffer);
      end && std::memcmp(end, kUnwritten.data(), kUnwritten.size()) == 0)
    throw HardwareError(Fault::kProtocol, name, "expose",
                        "the pixels of a frame lie before their places, and its end is missing",
                        "check the cable, then resume");
  return Unpack(format, {data, size}, width, height,
                BytesPerRow(format, width) + static_cast<std::size_t>(x_padding));
}

std::vector<AravisDevice> ListAravisDevices() {
  RequireDescriptors("cameras");
  arv_update_device_list();
  const auto text = [](const char* s) { return std::string(s ? s : ""); };
  std::vector<AravisDevice> devices;
  for (unsigned k = 0; k < arv_get_n_devices(); ++k)
    devices.push_back({text(arv_get_device_id(k)), text(arv_get_device_vendor(k)),
                       text(arv_get_device_model(k)), text(arv_get_device_serial_nbr(k)),
                       text(arv_get_device_address(k)), text(arv_get_device_protocol(k))});
  return devices;
}

AravisCamera::AravisCamera(const AravisOptions& options, std::shared_ptr<core::Clock> clock,
                           std::shared_ptr<Trigger> trigger)
    : clock_(std::move(clock)), session_(std::make_shared<Session>()) {
  session_->name = options.id.empty() ? "camera" : options.id;
  if (options.line_trigger && !trigger)
    throw HardwareError(Fault::kRefused, session_->name, "open",
                        "the line that is to trigger it is not open",
                        "mend what keeps the trigger from opening");
  if (options.line_trigger) session_->line = std::move(trigger);
  RequireDescriptors(session_->name);
  caller_.emplace(session_->name, clock_);
  const double deadline_s = clock_->MonotonicSeconds() + kOpen_s;
  capabilities_ = caller_->Call("open", deadline_s, [session = session_, options] {
    session->Open(options);
    return session->SetUp(options);
  });
  identity_ = session_->name;
  firmware_ = session_->firmware;
}

AravisCamera::~AravisCamera() { session_->aborted = true; }

AppliedSettings AravisCamera::Configure(const CameraSettings& settings, double deadline_s) {
  const double wanted = settings.exposure_s;
  // Cameras, aravis' own among them, take exposures outside of the bounds that they state.
  if (!(wanted >= capabilities_.min_exposure_s && wanted <= capabilities_.max_exposure_s))
    throw HardwareError(Fault::kOutOfRange, identity_, "configure",
                        fmt::format("{} s is not within {} s to {} s", wanted,
                                    capabilities_.min_exposure_s, capabilities_.max_exposure_s),
                        "choose exposures the camera has");
  const double set_us = caller_->Call("configure", deadline_s, [session = session_, wanted] {
    return session->SetExposure(kUsPerS * wanted);
  });
  const double set = set_us / kUsPerS;
  const double step = std::max(capabilities_.exposure_step_s, 1e-6);  // registers count at least us
  if (std::abs(set - wanted) > step + 0.01 * wanted)
    throw Refused(identity_, "configure",
                  fmt::format("asked for {} s, reads back {} s", wanted, set));
  applied_ = {set, applied_.settings_epoch + 1};
  return applied_;
}

Frame AravisCamera::Expose(double deadline_s) {
  if (applied_.settings_epoch == 0)
    throw HardwareError(Fault::kRefused, identity_, "expose", "no exposure time was set",
                        "configure it first");
  session_->aborted = false;
  // It gives up by itself a moment before the caller would.
  const double give_up_s = deadline_s - 2 * static_cast<double>(kPop_us) / kUsPerS;
  Frame frame =
      caller_->Call("expose", deadline_s, [session = session_, clock = clock_, give_up_s] {
        return session->Expose(*clock, give_up_s);
      });
  frame.settings = applied_;
  frame.frame_id = ++frames_;
  return frame;
}

void AravisCamera::Abort() { session_->aborted = true; }

}  // namespace luxfield::hal::aravis

#endif
