#include "tests/fakes/line_input.h"

#include <dlfcn.h>

#include <atomic>

namespace {

// Values of the camera's GenICam file.
constexpr guint32 kModeOn = 1, kSourceLine0 = 0, kRisingEdge = 0;

std::atomic<bool> edge_pending = false;

guint32 Register(ArvFakeCamera* camera, guint32 address) {
  guint32 value = 0;
  arv_fake_camera_read_register(camera, address, &value);
  return value;
}

bool WaitsForLine0(ArvFakeCamera* camera) {
  return Register(camera, ARV_FAKE_CAMERA_REGISTER_TRIGGER_MODE) == kModeOn &&
         Register(camera, ARV_FAKE_CAMERA_REGISTER_TRIGGER_SOURCE) == kSourceLine0 &&
         Register(camera, ARV_FAKE_CAMERA_REGISTER_TRIGGER_ACTIVATION) == kRisingEdge;
}

using Question = gboolean (*)(ArvFakeCamera*);
gboolean AskLibrary(const char* name, ArvFakeCamera* camera) {
  return reinterpret_cast<Question>(dlsym(RTLD_NEXT, name))(camera);
}

}  // namespace

bool luxfield::fakes::RaiseLine0(ArvFakeCamera* camera) {
  if (!WaitsForLine0(camera) || arv_fake_camera_get_acquisition_status(camera) == 0) return false;
  return !edge_pending.exchange(true);
}

// Both stand before the library's, which its server calls by name.
extern "C" gboolean arv_fake_camera_is_in_software_trigger_mode(ArvFakeCamera* camera) {
  return WaitsForLine0(camera) || AskLibrary(__func__, camera);
}

extern "C" gboolean arv_fake_camera_check_and_acknowledge_software_trigger(ArvFakeCamera* camera) {
  return WaitsForLine0(camera) ? edge_pending.exchange(false) : AskLibrary(__func__, camera);
}
