// A luminaire by its knot cells lit by two strategies.
#include "kernels/light_cells.clh"
#include "kernels/two_strategies.clh"
