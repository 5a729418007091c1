// A luminaire by its knot cells lit by two strategies.
#include "luxfield/render/kernels/mis/light_cells.clh"
#include "luxfield/render/kernels/mis/mis.clh"
