// A classical point or line, which samples that follow it light alone.
#include "luxfield/render/kernels/mis/light_classical_line.clh"
#include "luxfield/render/kernels/mis/mis.clh"
