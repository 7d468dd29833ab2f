// Relit photographs of a subject that moves while they are taken.
#pragma once

namespace lightwell::measure {

/// Renders a cycle of 29 photographs between two tracking frames, for a subject that moves sideways at two speeds, and
/// prints a line for each: errors with and without alignment. Minutes. `columns`: of the pictures, which are 4:3.
void measure_relight_motion(int columns, int samples);

}  // namespace lightwell::measure
