// An environment map lit by two strategies.
#include "luxfield/render/kernels/mis/light_environment.clh"
#include "luxfield/render/kernels/mis/mis.clh"
