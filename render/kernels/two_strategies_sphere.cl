// A sphere lit by two strategies.
#include "kernels/light_sphere.clh"
#include "kernels/two_strategies.clh"
