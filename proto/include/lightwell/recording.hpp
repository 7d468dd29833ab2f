// Recordings: a file of checksummed records that survives being cut off. The format in prose: proto/README.md.
//   RecordWriter, RecordReader   the container, whatever the records hold
//   RecordingHeader              the first record
//   FrameRecord                  a frame with its metadata, as bytes and back
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/checksum.hpp>
#include <lightwell/files.hpp>
#include <lightwell/pixel.hpp>
#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

namespace lightwell {

/// A larger record is taken for damage.
inline constexpr std::size_t kMaxRecordBytes = std::size_t{1} << 30;

enum class RecordingKind : std::uint8_t { descriptors = 1, frames = 2 };

struct RecordingHeader {
  RecordingKind kind = RecordingKind::descriptors;
  std::string probe_name;
  std::string version;
  std::optional<RigParameters> calibration;  ///< Frames only.
};

/// Appends records. An error leaves what was written before readable.
class RecordWriter {
 public:
  /// Makes a new file, or goes on with one of the same kind after dropping a torn tail.
  [[nodiscard]] static Result<RecordWriter> open(const std::string& path, const RecordingHeader& header);

  /// time_ns: CLOCK_MONOTONIC of the writer when the record came. resource_exhausted when the disk is full.
  [[nodiscard]] Status append(std::int64_t time_ns, std::span<const std::byte> payload);
  [[nodiscard]] Status flush();

 private:
  explicit RecordWriter(FilePointer file) : file_(std::move(file)) {}
  FilePointer file_;
};

struct Record {
  std::int64_t time_ns = 0;
  std::vector<std::byte> payload;
};

/// Reads records in order; a torn or damaged record ends the file, counted, and what came before stays good.
class RecordReader {
 public:
  /// data_loss where the file is no recording, naming what was found.
  [[nodiscard]] static Result<RecordReader> open(const std::string& path);

  [[nodiscard]] const RecordingHeader& header() const { return header_; }
  /// The next record into `out` (its memory is used again); false at the end.
  [[nodiscard]] bool next(Record& out);
  /// Bytes at the end that are no whole record, known once next() returned false.
  [[nodiscard]] std::uint64_t torn_bytes() const { return torn_bytes_; }
  /// Offset behind the last whole record.
  [[nodiscard]] std::uint64_t good_bytes() const { return good_bytes_; }
  /// Back to the first record behind the header.
  void rewind();

 private:
  friend class RecordWriter;
  RecordReader() = default;
  [[nodiscard]] static Result<RecordReader> read_header(FilePointer file, const std::string& path);
  [[nodiscard]] bool read(Record& out);
  FilePointer file_;
  RecordingHeader header_;
  std::uint64_t first_ = 0, good_bytes_ = 0, torn_bytes_ = 0, file_bytes_ = 0;
};

/// One lens's picture inside a FrameRecord.
struct RecordedView {
  int lens = 0;
  PixelFormat format = PixelFormat::rgb8;
  int width = 0, height = 0;
  std::size_t stride = 0;
  std::span<const std::byte> data;
};

struct FrameRecord {
  std::uint64_t sequence = 0;
  ProbeTime mid_exposure;
  double exposure_s = 0, gain = 1;
  Duration row_readout;
  int bracket_index = 0, bracket_size = 1;
  std::vector<RecordedView> views;
};

/// Into `out`, whose memory is used again.
void encode_frame_record(const FrameRecord& frame, std::vector<std::byte>& out);

/// A decoded frame; `frame.views` point into memory that this object owns.
class DecodedFrame {
 public:
  DecodedFrame();
  ~DecodedFrame();
  DecodedFrame(DecodedFrame&&) noexcept;
  DecodedFrame& operator=(DecodedFrame&&) noexcept;
  /// data_loss or invalid_argument with the field's name.
  [[nodiscard]] Status decode(std::span<const std::byte> payload);
  FrameRecord frame;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lightwell
