// A camera: the one interface that every backend implements and the conformance suite holds them to.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/config.hpp>
#include <lightwell/pixel.hpp>
#include <lightwell/result.hpp>

#include "camera/frame.hpp"

namespace lightwell {

/// What a camera will deliver once started.
struct CameraInfo {
  std::string name;           ///< For people: "sim:city", "UVC Camera (046d:0825)".
  int width = 0, height = 0;  ///< Of each view.
  PixelFormat format = PixelFormat::rgb8;
  int lenses = 1;
  double frame_rate = 0;                     ///< Nominal, 1/s; 0 where frames come as fast as they are taken.
  std::vector<double> exposure_s;            ///< The cycle in force; one entry where exposure does not change.
  std::optional<RigParameters> calibration;  ///< What the camera itself knows of its lenses, if anything.
  std::vector<std::string> notes;            ///< What was changed or mended to get there; worth saying once.
};

/// Life: open -> (start -> stop)* -> destroyed. Not thread-safe but for state(): one owner calls it.
///   - open() takes the device and settles what comes; it may give another size or rate than asked for and says so.
///   - start() begins calling sink.push() from one thread of the backend's own.
///   - stop() returns when no further push() will come; frames that are still held stay valid until the backend dies.
///   - A frame whose memory is still held is never written to; where all are held, the camera drops and the
///     sequence shows the gap.
class CameraBackend {
 public:
  virtual ~CameraBackend() = default;

  [[nodiscard]] virtual Result<CameraInfo> open() = 0;
  [[nodiscard]] virtual Status start(FrameSink& sink) = 0;
  virtual void stop() = 0;

  enum class State : std::uint8_t {
    idle,       ///< Not started, or stopped.
    streaming,  ///< Frames come.
    finished,   ///< A recording has come to its end.
    lost,       ///< The device went away. A backend that takes it up again when it returns is streaming from then on.
  };
  /// From any thread.
  [[nodiscard]] virtual State state() const = 0;
};

/// How many frames a backend must be able to lend at once for a bracket of `size` exposures: one bracket that the
/// estimator works on, one that waits, one that is being filled, and a frame in the camera's hands.
[[nodiscard]] constexpr int required_buffer_count(int bracket_size) { return 3 * bracket_size + 1; }

}  // namespace lightwell
