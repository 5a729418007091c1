#include "luxfield/core/error.h"

namespace luxfield {
namespace {

std::string Sentence(std::string_view file, std::string_view problem, std::string_view remedy) {
  std::string text;
  text.append(file).append(": ").append(problem);
  if (!remedy.empty()) text.append("; ").append(remedy);
  return text;
}

}  // namespace

InputError::InputError(std::string_view file, std::string_view problem, std::string_view remedy)
    : Error(Sentence(file, problem, remedy), 2) {}

}  // namespace luxfield
