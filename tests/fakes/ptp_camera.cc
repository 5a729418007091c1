#include "tests/fakes/ptp_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <initializer_list>
#include <utility>

namespace luxfield::fakes {
namespace {

using std::chrono::steady_clock;

// Codes of PIMA 15740.
constexpr std::uint16_t kGetDeviceInfo = 0x1001, kOpenSession = 0x1002, kCloseSession = 0x1003,
                        kGetStorageIds = 0x1004, kGetStorageInfo = 0x1005, kGetNumObjects = 0x1006,
                        kGetObjectHandles = 0x1007, kGetObjectInfo = 0x1008, kGetObject = 0x1009,
                        kDeleteObject = 0x100b, kInitiateCapture = 0x100e,
                        kGetDevicePropDesc = 0x1014, kGetDevicePropValue = 0x1015,
                        kSetDevicePropValue = 0x1016;
constexpr std::uint16_t kOk = 0x2001, kNotSupported = 0x2005, kInvalidHandle = 0x2009,
                        kPropertyNotSupported = 0x200a, kDeviceBusy = 0x2019;
constexpr std::uint16_t kObjectAdded = 0x4002, kCaptureComplete = 0x400d;
constexpr std::uint16_t kExposureTime = 0x500d, kExposureIndex = 0x500f;
constexpr std::uint16_t kDng = 0x3811, kStore = 1;
constexpr std::uint16_t kUint16 = 4, kUint32 = 6;
constexpr std::uint32_t kStorage = 0x00010001;

// PTP's numbers are little-endian; its texts are counted UTF-16 with a closing zero.
class Data {
 public:
  Data& U8(unsigned value) { return Number(value, 1); }
  Data& U16(unsigned value) { return Number(value, 2); }
  Data& U32(std::uint64_t value) { return Number(value, 4); }
  Data& Text(const std::string& text) {
    if (text.empty()) return U8(0);
    U8(static_cast<unsigned>(text.size()) + 1);
    for (const char c : text) U16(static_cast<unsigned char>(c));
    return U16(0);
  }
  Data& Codes(std::initializer_list<std::uint16_t> codes) {
    U32(codes.size());
    for (const std::uint16_t code : codes) U16(code);
    return *this;
  }
  PtpReply Reply() const { return {kOk, bytes_}; }

 private:
  Data& Number(std::uint64_t value, int size) {
    for (int k = 0; k < size; ++k) bytes_ += static_cast<char>(value >> 8 * k);
    return *this;
  }
  std::string bytes_;
};

std::uint32_t NumberOf(const std::string& bytes) {
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < std::min<std::size_t>(bytes.size(), 4); ++k)
    value |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[k])) << 8 * k;
  return value;
}

}  // namespace

PtpCamera::PtpCamera(std::vector<std::uint32_t> speeds, Shoot shoot)
    : speeds_(std::move(speeds)), shoot_(std::move(shoot)), speed_(speeds_.front()) {}

void PtpCamera::Set(const Faults& faults) {
  const std::lock_guard lock(mutex_);
  faults_ = faults;
}
int PtpCamera::exposures() const {
  const std::lock_guard lock(mutex_);
  return exposures_;
}
std::size_t PtpCamera::files() const {
  const std::lock_guard lock(mutex_);
  return files_.size();
}

void PtpCamera::Leave(int pictures) {
  const std::lock_guard lock(mutex_);
  for (int n = 0; n < pictures; ++n) files_[static_cast<std::uint32_t>(++exposures_)] = "picture";
}

PtpReply PtpCamera::Execute(const PtpOperation& operation) {
  const std::lock_guard lock(mutex_);
  const std::uint32_t handle = operation.parameters[0];
  switch (operation.code) {
    case kOpenSession:
      events_.clear();  // nobody was there to hear them
      return {};
    case kCloseSession:
      return {};
    case kGetDeviceInfo:
      return DeviceInfo();
    case kGetStorageIds:
      return Data().U32(1).U32(kStorage).Reply();
    case kGetStorageInfo:
      return StorageInfo();
    case kGetObjectHandles: {
      Data data;
      data.U32(files_.size());
      for (const auto& [number, file] : files_) data.U32(number);
      return data.Reply();
    }
    case kGetObjectInfo:
      return ObjectInfo(handle);
    case kGetObject: {
      const auto file = files_.find(handle);
      if (file == files_.end()) return {kInvalidHandle, {}};
      return {kOk, file->second};
    }
    case kDeleteObject:
      return {files_.erase(handle) ? kOk : kInvalidHandle, {}};
    case kInitiateCapture:
      return Capture(operation.transaction);
    case kGetDevicePropDesc:
      return Property(handle, true);
    case kGetDevicePropValue:
      return Property(handle, false);
    case kSetDevicePropValue:
      return SetProperty(handle, operation.data);
    default:
      return {kNotSupported, {}};
  }
}

PtpReply PtpCamera::DeviceInfo() const {
  Data data;
  data.U16(100).U32(0).U16(100).Text("").U16(0);  // version 1.00, no vendor's extensions
  data.Codes({kGetDeviceInfo, kOpenSession, kCloseSession, kGetStorageIds, kGetStorageInfo,
              kGetObjectHandles, kGetObjectInfo, kGetObject, kDeleteObject, kInitiateCapture,
              kGetDevicePropDesc, kGetDevicePropValue, kSetDevicePropValue});
  data.Codes({kObjectAdded, kCaptureComplete});
  data.Codes({kExposureTime, kExposureIndex});
  data.Codes({kDng}).Codes({kDng});
  return data.Text("Luxfield").Text("Fake PTP").Text("1.0").Text("LUX7").Reply();
}

PtpReply PtpCamera::StorageInfo() const {
  Data data;
  data.U16(4).U16(2).U16(0);                            // removable RAM, hierarchical, read-write
  data.U32(1u << 30).U32(0).U32(1u << 30).U32(0);       // size and room, bytes
  return data.U32(9999).Text("card").Text("").Reply();  // room, pictures
}

PtpReply PtpCamera::ObjectInfo(std::uint32_t handle) const {
  const auto file = files_.find(handle);
  if (file == files_.end()) return {kInvalidHandle, {}};
  Data data;
  data.U32(kStorage).U16(kDng).U16(0).U32(file->second.size()).U16(0);
  for (int k = 0; k < 6; ++k) data.U32(0);  // thumbnail and picture: sizes
  data.U32(0).U16(0).U32(0).U32(0);         // parent, association, sequence number
  return data.Text(fmt::format("LUX_{:04}.DNG", handle))
      .Text("20260101T000000")
      .Text("20260101T000000")
      .Text("")
      .Reply();
}

PtpReply PtpCamera::Property(std::uint32_t property, bool described) const {
  const bool time = property == kExposureTime;
  if (!time && property != kExposureIndex) return {kPropertyNotSupported, {}};
  Data data;
  const auto number = [&](std::uint32_t value) {
    if (time)
      data.U32(value);
    else
      data.U16(value);
  };
  if (!described) {
    number(time ? speed_ : iso_);
    return data.Reply();
  }
  const std::vector<std::uint32_t> choices =
      time ? speeds_ : std::vector<std::uint32_t>{100, 200, 400};
  data.U16(property).U16(time ? kUint32 : kUint16).U8(1);  // can be set
  number(choices.front());
  number(time ? speed_ : iso_);
  data.U8(2).U16(static_cast<unsigned>(choices.size()));  // one of a list
  for (const std::uint32_t choice : choices) number(choice);
  return data.Reply();
}

PtpReply PtpCamera::SetProperty(std::uint32_t property, const std::string& value) {
  if (faults_.always_deaf || faults_.deaf > 0) {
    faults_.deaf -= faults_.deaf > 0;
    return {};
  }
  if (property == kExposureTime)
    speed_ = NumberOf(value);
  else if (property == kExposureIndex)
    iso_ = static_cast<std::uint16_t>(NumberOf(value));
  else
    return {kPropertyNotSupported, {}};
  return {};
}

PtpReply PtpCamera::Capture(std::uint32_t transaction) {
  const auto now = steady_clock::now();
  if (faults_.busy > 0 || now < free_at_) {
    faults_.busy -= faults_.busy > 0;
    return {kDeviceBusy, {}};
  }
  const double exposure_s = 1e-4 * (faults_.another_speed ? speeds_.front() : speed_);
  free_at_ = now + std::chrono::duration_cast<steady_clock::duration>(
                       std::chrono::duration<double>(exposure_s));
  std::string file = shoot_(exposure_s, ++exposures_);
  if (faults_.again && !last_file_.empty()) file = last_file_;
  last_file_ = file;
  file.resize(file.size() - std::min(file.size(), faults_.cut));
  const auto handle = static_cast<std::uint32_t>(exposures_);
  files_[handle] = std::move(file);
  if (!faults_.lost) {
    events_.push_back({free_at_, {kObjectAdded, handle}});
    events_.push_back({free_at_, {kCaptureComplete, transaction}});
  }
  changed_.notify_all();
  return {};
}

std::optional<PtpEvent> PtpCamera::WaitEvent(steady_clock::time_point give_up) {
  std::unique_lock lock(mutex_);
  for (;;) {
    const auto now = steady_clock::now();
    if (!events_.empty() && events_.front().at <= now) {
      const PtpEvent event = events_.front().event;
      events_.pop_front();
      return event;
    }
    if (woken_ || now >= give_up) {
      woken_ = false;
      return std::nullopt;
    }
    changed_.wait_until(lock, events_.empty() ? give_up : std::min(give_up, events_.front().at));
  }
}

void PtpCamera::Wake() {
  {
    const std::lock_guard lock(mutex_);
    woken_ = true;
  }
  changed_.notify_all();
}

}  // namespace luxfield::fakes
