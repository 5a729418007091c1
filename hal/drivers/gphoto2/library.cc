#if LUXFIELD_GPHOTO2

#include "luxfield/hal/drivers/gphoto2/library.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <string_view>

#include "luxfield/hal/permission.h"

namespace luxfield::hal::gphoto2 {

bool Busy(int result) { return result == GP_ERROR_CAMERA_BUSY || result == GP_ERROR_IO_LOCK; }

std::optional<HardwareError> RefusalOf(const std::string& port) {
  constexpr std::string_view kUsb = "usb:";
  if (!port.starts_with(kUsb)) return {};
  std::string node = "/dev/bus/usb/" + port.substr(kUsb.size());  // "usb:BUS,DEVICE"
  std::replace(node.begin(), node.end(), ',', '/');
  const int file = ::open(node.c_str(), O_RDWR | O_CLOEXEC);
  const bool is_forbidden = file < 0 && errno == EACCES;
  if (file >= 0) ::close(file);
  if (!is_forbidden) return {};
  return HardwareError(Fault::kRefused, port, "open", "Permission denied", kJoinPlugdev);
}

HardwareError Failed(int result, const std::string& device, const std::string& operation) {
  Fault fault = Fault::kProtocol;
  const char* remedy = "power-cycle the camera, then resume";
  switch (result) {
    case GP_ERROR_IO:
    case GP_ERROR_IO_READ:
    case GP_ERROR_IO_WRITE:
    case GP_ERROR_IO_USB_FIND:
    case GP_ERROR_IO_INIT:
    case GP_ERROR_MODEL_NOT_FOUND:
    case GP_ERROR_UNKNOWN_PORT:
    case GP_ERROR_BAD_PARAMETERS:
      fault = Fault::kDisconnected;
      remedy = "check cable and power; `luxfield devices` lists what is there";
      break;
    case GP_ERROR_TIMEOUT:
      fault = Fault::kTimeout;
      break;
    case GP_ERROR_IO_USB_CLAIM:
    case GP_ERROR_IO_LOCK:
    case GP_ERROR_CAMERA_BUSY:
      fault = Fault::kRefused;
      remedy = "end the program that holds the camera (a desktop may mount it), or wait";
      break;
    case GP_ERROR_CANCEL:
      fault = Fault::kStopped;
      remedy = "resume the session";
      break;
    default:
      break;
  }
  return {fault, device, operation, gp_result_as_string(result), remedy};
}

std::vector<std::string> ChoicesOf(CameraWidget* widget) {
  std::vector<std::string> choices;
  CameraWidgetType type{};
  gp_widget_get_type(widget, &type);
  if (type != GP_WIDGET_RADIO && type != GP_WIDGET_MENU) return choices;
  for (int k = 0; k < gp_widget_count_choices(widget); ++k) {
    const char* choice = nullptr;
    if (gp_widget_get_choice(widget, k, &choice) == GP_OK && choice) choices.emplace_back(choice);
  }
  return choices;
}

std::optional<std::string> TextOf(CameraWidget* widget) {
  CameraWidgetType type{};
  gp_widget_get_type(widget, &type);
  if (type != GP_WIDGET_RADIO && type != GP_WIDGET_MENU && type != GP_WIDGET_TEXT)
    return std::nullopt;
  const char* value = nullptr;
  if (gp_widget_get_value(widget, &value) != GP_OK || !value) return std::nullopt;
  return value;
}

OwnedList DetectedCameras(GPContext* context) {
  CameraList* list = nullptr;
  gp_list_new(&list);
  gp_camera_autodetect(list, context);
  return OwnedList(list);
}

std::string PortOf(CameraList* list, int k) {
  const char* port = nullptr;
  return gp_list_get_value(list, k, &port) == GP_OK && port ? port : "";
}

std::string ModelOf(CameraList* list, int k) {
  const char* model = nullptr;
  return gp_list_get_name(list, k, &model) == GP_OK && model ? model : "";
}

}  // namespace luxfield::hal::gphoto2

#endif
