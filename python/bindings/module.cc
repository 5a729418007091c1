// luxfield._luxfield: the library's data in numpy arrays. The package around it is ../luxfield.
#include "bindings.h"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <tbb/global_control.h>

#include <memory>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file_kind.h"
#include "luxfield/version.h"

namespace py = pybind11;

namespace luxfield::python {

void AddErrors() {
  // Python's classes are given by the package, which defines them with their documentation.
  py::register_exception_translator([](std::exception_ptr thrown) {
    if (!thrown) return;
    const auto raise = [](const char* name, const std::exception& error) {
      const py::object type = py::module_::import("luxfield.errors").attr(name);
      PyErr_SetString(type.ptr(), error.what());
    };
    try {
      std::rethrow_exception(thrown);
    } catch (const InputError& error) {
      raise("InputError", error);
    } catch (const DeviceError& error) {
      raise("DeviceError", error);
    } catch (const Interrupted& error) {
      raise("Interrupted", error);
    }
  });
}

// Objects that `Class.__new__` made alone have no value. pybind11 would give them memory with anything
// in it as soon as one is used.
void RefuseObjectsWithoutValue(const py::module_& module) {
  for (const auto& [name, thing] : module.attr("__dict__").cast<py::dict>())
    if (PyType_Check(thing.ptr()))
      if (auto* type = py::detail::get_type_info(reinterpret_cast<PyTypeObject*>(thing.ptr())))
        type->operator_new = [](std::size_t) -> void* {
          throw py::type_error(
              "the object was made by __new__ alone and holds nothing; call its class, or read()");
        };
}

// Of all calls that Python makes of the module.
void SetThreads(int threads) {
  static std::unique_ptr<tbb::global_control> control;
  control.reset();
  if (threads > 0)
    control = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                    static_cast<std::size_t>(threads));
}

}  // namespace luxfield::python

PYBIND11_MODULE(_luxfield, module) {
  using namespace luxfield;
  module.doc() = "The data of luxfield in numpy arrays; use it through the package `luxfield`.";
  module.attr("__version__") = LUXFIELD_VERSION;
  module.attr("LUMINANCE_WEIGHTS") = py::make_tuple(
      core::Luminance({1, 0, 0}), core::Luminance({0, 1, 0}), core::Luminance({0, 0, 1}));
  python::AddErrors();
  python::AddLightField(module);
  python::AddMeasurements(module);
  python::AddSampler(module);
  python::AddEnvironment(module);
  python::AddPicture(module);

  py::enum_<core::FileKind>(module, "FileKind", "What a file is, by its content.")
      .value("LIGHT_FIELD", core::FileKind::kLightField)
      .value("MEASUREMENTS", core::FileKind::kMeasurements)
      .value("PICTURE", core::FileKind::kExrPicture)
      .value("RADIANCE_HDR", core::FileKind::kRadianceHdr)
      .value("OTHER", core::FileKind::kUnknown);
  module.def(
      "what_is",
      [](const std::filesystem::path& path) {
        const core::FileKind kind = core::WhatIs(path);
        const bool known =
            kind == core::FileKind::kLightField || kind == core::FileKind::kMeasurements ||
            kind == core::FileKind::kExrPicture || kind == core::FileKind::kRadianceHdr;
        return std::pair(known ? kind : core::FileKind::kUnknown, core::NameOf(kind));
      },
      py::arg("path"), "The kind of a file, and what it is in words.");
  module.def("set_threads", &python::SetThreads, py::arg("threads"),
             "How many threads calls of this module take, 0 for all cores.");
  python::RefuseObjectsWithoutValue(module);
}
