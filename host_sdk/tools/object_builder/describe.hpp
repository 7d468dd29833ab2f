// Writes the description of a capture, object.json, from what a marker in its photographs shows.
#pragma once

#include <string>

#include <lightwell/result.hpp>

#include "marker_rig.hpp"

namespace lightwell::tool {

/// Patterns of file names in the folder, with {view} and, of pictures and estimates, {light}.
struct CaptureNames {
  std::string pictures, coverage, ambient;  ///< As in object.json; ambient may be empty.
  std::string estimates;                    ///< Of the JSON that lightwell-estimate --body wrote for each picture.
};

/// What was found, and written.
struct Description {
  MarkerRig marker;
  std::size_t views = 0, lights = 0, photographs = 0;
  std::size_t without_marker = 0;  ///< Of the photographs, how many have no estimate.
};

/// Counts the pictures, reads the estimates and writes FOLDER/object.json. `focal_px` is the focal length of the camera
/// in pixels of the pictures. failed_precondition if there is an object.json; not_found without pictures;
/// invalid_argument, naming the file, for an estimate that is none; as rig_of().
[[nodiscard]] Result<Description> describe_capture(const std::string& folder, const CaptureNames& names,
                                                   double focal_px);

}  // namespace lightwell::tool
