// fake_still_camera LAB STATE: a still camera on the network (PTP/IP), which sees the simulated lab
// of LAB where the devices of a bench have put it. Prints the port as libgphoto2 names it, and ends
// with its input.
#include <iostream>
#include <string>

#include "tests/fakes/dng.h"
#include "tests/fakes/ptp_camera.h"
#include "tests/fakes/ptp_ip_host.h"
#include "tests/fakes/seen_lab.h"

namespace luxfield::fakes {
namespace {

int Serve(const char* lab, const char* state) {
  SeenLab seen(lab, state);
  const std::string& cfa = seen.lab().camera.sensor.cfa;
  PtpCamera camera({1, 5, 25, 125, 625}, [&](double exposure_s, int) {
    session::RawFrame frame = seen.Expose(exposure_s);
    return EncodeDng({frame.width, frame.height, std::move(frame.dn), cfa, exposure_s});
  });
  const PtpIpHost host(camera);
  std::cout << host.port() << std::endl;
  for (std::string line; std::getline(std::cin, line);) {
  }
  return 0;
}

}  // namespace
}  // namespace luxfield::fakes

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: fake_still_camera LAB STATE\n";
    return 2;
  }
  try {
    return luxfield::fakes::Serve(argv[1], argv[2]);
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
}
