// A classical area lit by two strategies.
#include "luxfield/render/kernels/mis/light_classical_area.clh"
#include "luxfield/render/kernels/mis/mis.clh"
