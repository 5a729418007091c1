// libgphoto2's objects, owned, and what its results mean. Only for this folder.
#pragma once

#include <gphoto2/gphoto2.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/hal/error.h"

namespace luxfield::hal::gphoto2 {

template <auto Free>
struct Freed {
  template <typename T>
  void operator()(T* object) const {
    Free(object);
  }
};
using OwnedContext = std::unique_ptr<GPContext, Freed<gp_context_unref>>;
using OwnedFile = std::unique_ptr<CameraFile, Freed<gp_file_unref>>;
using OwnedList = std::unique_ptr<CameraList, Freed<gp_list_unref>>;
using OwnedWidget = std::unique_ptr<CameraWidget, Freed<gp_widget_free>>;
using OwnedPorts = std::unique_ptr<GPPortInfoList, Freed<gp_port_info_list_free>>;
using OwnedModels = std::unique_ptr<CameraAbilitiesList, Freed<gp_abilities_list_free>>;

bool Busy(int result);
// Why this user may not open the camera on a port, which libgphoto2 calls an I/O problem; nothing:
// he may, or it is not on USB.
std::optional<HardwareError> RefusalOf(const std::string& port);

HardwareError Failed(int result, const std::string& device, const std::string& operation);

// Of a setting: its choices, none where it is of another kind; its value, of one that is text or
// has choices.
std::vector<std::string> ChoicesOf(CameraWidget* widget);
std::optional<std::string> TextOf(CameraWidget* widget);

// Cameras on USB, and port and model of one of them.
OwnedList DetectedCameras(GPContext* context);
std::string PortOf(CameraList* list, int k);
std::string ModelOf(CameraList* list, int k);

}  // namespace luxfield::hal::gphoto2
