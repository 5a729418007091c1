#include "tests/fuzz/zaber_message.h"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  luxfield::fuzz::ZaberMessage({reinterpret_cast<const char*>(data), size});
  return 0;
}
