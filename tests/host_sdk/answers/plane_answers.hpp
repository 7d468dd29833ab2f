// Results of the C++ API of captured planes, for comparison with the other languages.
//   FOLDER/planes.txt         messages for one reader, queries and the results of C++; the format is below
//   FOLDER/planes.lwrec       the accepted messages, and a descriptor, as a recording
//   FOLDER/plane_objects.txt  a plane, and virtual objects on it
//   FOLDER/plane_mutants.txt  damaged messages, and whether C++ accepts them
//
// A line is a word and numbers, %.9g, which gives every float back; %.17g for what is double:
//   take STATUS MS HEX        a message for the reader at MS ms; STATUS is the name of a StatusCode
//   snapshot MS               the following is for a snapshot at MS ms
//   info validity revision missing capture edge  size  x y rotation scale  alpha f0  units
//                             alpha, f0: -1 where not known
//   pose tx ty tz  qx qy qz qw
//   radiance layers px py  ex ey ez  validity flags  r g b
//   specular x y z  validity flags  r g b
//   texel index  flags  r g b the diffuse part at the texel's centre
//   guidance progress  seen gap  nx ny nz  circle
//                             n: 0 0 0 where all was seen
//   probe x y z               0 0 0 where not known
//   coverage index  x y  seen
//   camera width height fx fy cx cy  px py pz  qx qy qz qw  layers  validity flags pixels flagged
//   pixel index  flags  r g b of the camera before; of pixels that show the plane
// In plane_objects.txt:
//   take, lighting            a PlaneUpdate, and a LightingDescriptor, HEX
//   reflection validity texels
//   reflected index  r g b  hidden
//   shadow index  r g b       ratios
//   light x y z  nx ny nz  layers  validity flags source  r g b
//   light_in x y z  nx ny nz  validity flags source  r g b
//                             in the lighting; the scene is in the code
// And in plane_mutants.txt:
//   mutant STATUS HEX         after "ok" follows
//   update revision edge tiles  r g b
//                             r g b of the last entry of the last tile that has radiance, else 0 0 0
#pragma once

#include <filesystem>

namespace lightwell::test {

/// Throws std::runtime_error if a file cannot be written.
void write_plane_answers(const std::filesystem::path& folder);

}  // namespace lightwell::test
