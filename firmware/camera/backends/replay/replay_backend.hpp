// Camera backend that plays a recording of frames or a folder of pictures.
#pragma once

#include <memory>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

#include "camera/backend.hpp"
#include "imaging/uri.hpp"

namespace lightwell {

/// replay:PATH?loop=N&pace=recorded|fast
///   - PATH: a recording of kind frames, or a folder with frames.csv (source.hpp) and, optionally,
///     calibration.textproto. open() reads it. Size, exposures, gain and frame rate are those of the recording. Of
///     `config` the rate of a single frame is used; size and rate are ignored otherwise, capture settings are refused.
///   - loop: number of times it is played, 0: endlessly; default 1. At the end state() is finished.
///   - pace=recorded (default): with the recorded intervals. Mid-exposure times are shifted so that the first one is
///     the time of start(). If no frame may be lent, or the sink blocked the thread for longer than a frame interval,
///     frames are dropped as by a live camera. If the disk is too slow, the remaining frames are delayed.
///   - pace=fast: as fast as the sink has space and releases frames, without drops. The recorded intervals are lost: a
///     frame's exposure ends when it is pushed, so temporal filters behave differently than at the recorded pace.
///
/// Sequence numbers are the recorded ones with their gaps, and continue to increase over loops and starts. start()
/// begins at the first frame. A frame that cannot be played (damaged, or of another size than the first) is a gap; a
/// damaged tail ends the recording. At most required_buffer_count(bracket) frames are lent at the same time.
///
/// invalid_argument for invalid parameters; open() returns not_found, data_loss or invalid_argument.
[[nodiscard]] Result<std::unique_ptr<CameraBackend>> make_replay_backend(const CameraUri& uri,
                                                                         const CameraConfig& config);

}  // namespace lightwell
