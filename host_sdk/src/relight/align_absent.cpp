// A build without OpenCV.
#include <lightwell/relight_align.hpp>

namespace lightwell {

Result<AlignmentSummary> align_photographs(int /*columns*/, int /*rows*/, const TimedPhotograph& /*first_tracking*/,
                                           const TimedPhotograph& /*second_tracking*/,
                                           std::span<const TimedPhotograph> /*photographs*/,
                                           std::vector<std::vector<Radiance>>& /*out*/) {
  return Status(StatusCode::failed_precondition,
                "this build has no OpenCV, which alignment needs: install libopencv-dev and build again");
}

}  // namespace lightwell
