// A rectangle lit by two strategies.
#include "kernels/light_rectangle.clh"
#include "kernels/two_strategies.clh"
