// fake_device grbl|zaber [--speed-up F] [NUMBER=VALUE ...]: a fake stage controller on a pseudo
// terminal, for tests of the whole program. Prints the port's path, then takes a command a line
// from standard input: `freeze`, `thaw`, or what can happen to the device ("power cycle", "limit
// switch"). Ends with its input.
#include <fmt/format.h>

#include <cstdlib>
#include <iostream>
#include <map>
#include <memory>
#include <string>

#include "tests/fakes/grbl_machine.h"
#include "tests/fakes/pty_host.h"
#include "tests/fakes/zaber_chain.h"

int main(int argc, char** argv) {
  using namespace luxfield::fakes;
  std::map<int, double> settings;
  double speed_up = 1;
  for (int k = 2; k < argc; ++k) {
    const std::string word = argv[k];
    const auto equals = word.find('=');
    if (word == "--speed-up" && k + 1 < argc)
      speed_up = std::atof(argv[++k]);
    else if (equals != std::string::npos)
      settings[std::atoi(word.c_str())] = std::atof(word.c_str() + equals + 1);
  }
  const std::string kind = argc > 1 ? argv[1] : "";
  std::unique_ptr<FakeDevice> device;
  if (kind == "grbl") device = std::make_unique<GrblMachine>(settings);
  if (kind == "zaber") device = std::make_unique<ZaberChain>();
  if (!device) {
    std::cerr << "usage: fake_device grbl|zaber [--speed-up F] [NUMBER=VALUE ...]\n";
    return 2;
  }
  PtyHost host(std::move(device), speed_up);
  std::cout << host.port() << std::endl;
  for (std::string line; std::getline(std::cin, line);) {
    if (line == "freeze" || line == "thaw")
      host.Freeze(line == "freeze");
    else if (!host.Suffer(line))
      std::cerr << "unknown event: " << line << "\n";
  }
  return 0;
}
