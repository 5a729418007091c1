// Kernels that the choice of an estimator (choose_setting.h) compiles on a machine that has none of them
// yet, some 8 core-seconds of PoCL's compiler, which works in one thread of a process: another process
// that compiles them meanwhile, last one first, spares a part of the wait.
//
//   render::CompilePilotKernels(device, render::PilotSurfaces::kGlossy);
//
// PoCL keeps what it compiles between runs; nothing is returned, and no result depends on it.
#pragma once

#include <optional>

#include "luxfield/core/cache.h"
#include "luxfield/render/device/device.h"

namespace luxfield::render {

enum class PilotSurfaces { kLambertian, kGlossy };

// True if the device's driver compiles kernels when they are first run, and keeps them itself.
bool CompilesWhileRunning(const Device& device);

// Under which it is kept that their compiling was begun; none where builds cannot be told apart.
std::optional<core::CacheKey> PilotKernelsKey(const Device& device, PilotSurfaces surfaces);

// Lights a few receivers by one luminaire with traced shadows, by every estimator that may be chosen.
void CompilePilotKernels(const Device& device, PilotSurfaces surfaces);

}  // namespace luxfield::render
