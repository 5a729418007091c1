#include "luxfield/view/lighting/failure.h"

#include <fmt/format.h>

#include <filesystem>
#include <new>

#include "luxfield/core/error.h"

namespace luxfield::view {

Failure CurrentFailure() {
  try {
    throw;
  } catch (const Error& error) {
    return {error.what(), error.exit_code()};
  } catch (const std::bad_alloc&) {
    return {"out of memory; close other programs, or look at a smaller picture", 3};
  } catch (const std::filesystem::filesystem_error& error) {
    return {fmt::format("{}: cannot be used: {}; check the path and who may read it",
                        error.path1().string(), error.code().message()),
            2};
  } catch (const std::exception& error) {
    return {fmt::format("a bug in luxfield: {}", error.what()), 1};
  }
}

}  // namespace luxfield::view
