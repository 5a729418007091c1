// libFuzzer's entry for one of the targets; CMakeLists.txt says which, and in which header it is.
#include LUXFIELD_FUZZ_HEADER

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  luxfield::fuzz::LUXFIELD_FUZZ_TARGET({reinterpret_cast<const char*>(data), size});
  return 0;
}
