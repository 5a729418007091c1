// An environment map lit by two strategies.
#include "kernels/light_environment.clh"
#include "kernels/two_strategies.clh"
