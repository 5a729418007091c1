// What the cameras of this test program send: the program's own sendmsg, in aravis_camera_test.cc,
// stands before the system's.
#pragma once

#include <atomic>

namespace luxfield::hal::aravis {

// They take everything and say nothing, neither answers nor pixels.
extern std::atomic<bool> cameras_are_mute;

}  // namespace luxfield::hal::aravis
