// A sphere lit by two strategies.
#include "luxfield/render/kernels/mis/light_sphere.clh"
#include "luxfield/render/kernels/mis/mis.clh"
