// Replaces filament_sh.cpp if libfilament-dev is not installed.
#include "bench/filament_sh.hpp"

namespace lightwell::bench {

struct FilamentRoute::State {};

bool FilamentRoute::available() { return false; }
FilamentRoute::FilamentRoute() = default;
FilamentRoute::~FilamentRoute() = default;
void FilamentRoute::load(const EquirectImage&) {}
FilamentSh FilamentRoute::run() { return {}; }

}  // namespace lightwell::bench
