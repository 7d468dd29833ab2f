// The camera that was: plays a recording of frames, or a folder of pictures, like any other
// backend.
#pragma once

#include <memory>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

#include "camera/backend.hpp"
#include "camera/uri.hpp"

namespace lightwell {

/// replay:PATH?loop=N&pace=recorded|fast
///   - PATH: a recording of kind frames, or a folder with frames.csv (frame_list.hpp) and,
///   optionally,
///     calibration.textproto. Read by open(); what it holds is what comes, whatever `config` asks
///     for.
///   - loop: how often it is played, 0 for ever; 1 where absent. Then state() is finished.
///   - pace=recorded (default): with the original spacing. The mid-exposure times are the recorded
///   ones, shifted
///     so that the first exposure's middle is the moment of start(): frames look live. Where no
///     frame may be lent, or the sink held the thread up for longer than a frame lasts, frames are
///     dropped as a camera would. Where the disk is too slow, the rest is shifted on.
///   - pace=fast: as fast as the sink has room for them and gives them back, without a drop. The spacing is lost: a
///     frame's exposure ends when it is handed over, so filters over time see another world than at the recorded
///     pace.
///
/// Sequence numbers are the recorded ones with their gaps, and go on growing over loops and starts.
/// start() begins at the front. A frame that cannot be shown (damaged, or of another size than the
/// first) is a gap; a recording's damaged tail ends it. At most required_buffer_count(bracket) frames are
/// lent at once.
///
/// invalid_argument for parameters that make no sense; open() says not_found, data_loss or
/// invalid_argument.
[[nodiscard]] Result<std::unique_ptr<CameraBackend>> make_replay_backend(const CameraUri& uri,
                                                                         const CameraConfig& config);

}  // namespace lightwell
