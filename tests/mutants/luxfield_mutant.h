// Only in the copy of the tree that tests/mutants makes: which of the mistakes is made.
#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

// What the mistakes may well be warned of.
#pragma GCC diagnostic ignored "-Wparentheses"
#pragma GCC diagnostic ignored "-Wunused-value"
#pragma GCC diagnostic ignored "-Wunused-variable"
#pragma GCC diagnostic ignored "-Wunused-but-set-variable"
#pragma GCC diagnostic ignored "-Wunused-parameter"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-compare"
#pragma GCC diagnostic ignored "-Wtype-limits"
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#pragma GCC diagnostic ignored "-Wextra"

namespace luxfield_mutants {

// A mutant's number, 0 none, -1 none but note all that are reached.
inline const int chosen = [] {
  const char* text = std::getenv("LUXFIELD_MUTANT");
  return text ? std::atoi(text) : 0;
}();

// The file LUXFIELD_MUTANT_REACHED, one byte a mutant, shared with the children of a test.
inline unsigned char* Reached() {
  static unsigned char* const bytes = [] {
    const char* path = std::getenv("LUXFIELD_MUTANT_REACHED");
    const int file = path ? ::open(path, O_RDWR | O_CLOEXEC) : -1;
    if (file < 0) return static_cast<unsigned char*>(nullptr);
    const off_t size = ::lseek(file, 0, SEEK_END);
    void* const map = ::mmap(nullptr, static_cast<std::size_t>(size), PROT_READ | PROT_WRITE,
                             MAP_SHARED, file, 0);
    ::close(file);
    return map == MAP_FAILED ? nullptr : static_cast<unsigned char*>(map);
  }();
  return bytes;
}

inline bool Note(int number) {
  if (unsigned char* const bytes = Reached()) bytes[number] = 1;
  return false;
}

// The text of a kernel with the macro in it. Where the chosen mutant is elsewhere the text is the
// same for all, so that its compiled form is found again.
inline std::string WithMutant(const std::string& kernel) {
  const std::string mark = "LUXFIELD_MUTANT(";
  int active = 0;
  bool any = false;
  for (std::size_t at = kernel.find(mark); at != std::string::npos;
       at = kernel.find(mark, at + 1)) {
    const int number = std::atoi(kernel.c_str() + at + mark.size());
    if (chosen < 0) Note(number);
    if (chosen == number) active = number;
    any = true;
  }
  return any ? "#define LUXFIELD_MUTANT(n) ((n) == " + std::to_string(active) + ")\n" + kernel
             : kernel;
}

}  // namespace luxfield_mutants

#define LUXFIELD_MUTANT(n)              \
  (::luxfield_mutants::chosen == (n) || \
   (::luxfield_mutants::chosen < 0 && ::luxfield_mutants::Note(n)))
