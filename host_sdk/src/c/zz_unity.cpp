#include "conventions.cpp"
#include "library.cpp"
#include "lighting.cpp"
#include "probe.cpp"
