// A rectangle lit by two strategies.
#include "luxfield/render/kernels/mis/light_rectangle.clh"
#include "luxfield/render/kernels/mis/mis.clh"
