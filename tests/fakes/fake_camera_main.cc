// fake_camera SERIAL LAB STATE: aravis' own GigE Vision camera on 127.0.0.1, which sees the
// simulated lab of LAB where the devices of a bench have put it (bench_state.h). An exposure takes
// its time. Prints "ready", and ends with its input; a line "edge" there is one at the camera's
// input Line0.
#include <arv.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <iostream>
#include <string>
#include <thread>

#include "tests/fakes/line_input.h"
#include "tests/fakes/seen_lab.h"

namespace luxfield::fakes {
namespace {

void Fill(ArvBuffer* buffer, void* seen, guint32 exposure_us, guint32, ArvPixelFormat) {
  const double exposure_s = 1e-6 * exposure_us;
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(exposure_s);
  const session::RawFrame frame = static_cast<SeenLab*>(seen)->Expose(exposure_s);
  std::size_t size = 0;  // within the callback the buffer does not know it yet
  auto* out = static_cast<std::uint8_t*>(const_cast<void*>(arv_buffer_get_data(buffer, &size)));
  const auto pixels = static_cast<std::size_t>(arv_buffer_get_image_width(buffer)) *
                      static_cast<std::size_t>(arv_buffer_get_image_height(buffer));
  std::memset(out, 0, 2 * pixels);
  std::memcpy(out, frame.dn.data(), 2 * std::min(pixels, frame.dn.size()));
  std::this_thread::sleep_until(end);
}

int Serve(const char* serial, const char* lab, const char* state) {
  SeenLab seen(lab, state);
  ArvGvFakeCamera* server = arv_gv_fake_camera_new("127.0.0.1", serial);
  if (!server || !arv_gv_fake_camera_is_running(server)) {
    std::cerr << "cannot serve on 127.0.0.1\n";
    return 1;
  }
  ArvFakeCamera* camera = arv_gv_fake_camera_get_fake_camera(server);
  arv_fake_camera_set_fill_pattern(camera, Fill, &seen);
  std::cout << "ready" << std::endl;
  for (std::string line; std::getline(std::cin, line);)
    if (line == "edge") RaiseLine0(camera);
  g_object_unref(server);
  return 0;
}

}  // namespace
}  // namespace luxfield::fakes

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "usage: fake_camera SERIAL LAB STATE\n";
    return 2;
  }
  try {
    return luxfield::fakes::Serve(argv[1], argv[2], argv[3]);
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
}
