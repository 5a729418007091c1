// What each file of this folder adds to the module: the classes and functions of one room.
#pragma once

#include <pybind11/pybind11.h>

namespace luxfield::python {

void AddErrors();
void AddLightField(pybind11::module_& module);
void AddMeasurements(pybind11::module_& module);
void AddSampler(pybind11::module_& module);
void AddEnvironment(pybind11::module_& module);
void AddPicture(pybind11::module_& module);

}  // namespace luxfield::python
