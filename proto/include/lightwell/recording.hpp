// Recordings: a file of checksummed records that stays readable if it is truncated. Format: proto/README.md.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <lightwell/files.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// A larger record counts as damaged.
inline constexpr std::size_t kMaxRecordBytes = std::size_t{1} << 30;

enum class RecordingKind : std::uint8_t { descriptors = 1, frames = 2, descriptors_and_planes = 3 };

/// What a record of a recording of messages holds; the payload of a record of frames is a FrameRecord.
enum class RecordedMessage : std::uint8_t {
  descriptor,  ///< A LightingDescriptor.
  plane,       ///< A PlaneUpdate; only in a recording of descriptors_and_planes.
  unknown,     ///< Neither: damaged before it was recorded, or of a later version.
};

struct RecordingHeader {
  RecordingKind kind = RecordingKind::descriptors;
  std::string probe_name;
  std::string version;
  std::optional<std::string> calibration;  ///< Frames only: a RigCalibration in binary form.
};

/// Appends records. After an error, the records written before remain readable.
class RecordWriter {
 public:
  /// Creates a file, or continues one of the same kind after removing an incomplete record at its end.
  /// invalid_argument if the header's calibration is not a RigCalibration.
  [[nodiscard]] static Result<RecordWriter> open(const std::string& path, const RecordingHeader& header);

  /// time_ns: CLOCK_MONOTONIC of the writer when the record was received. resource_exhausted if the disk is full.
  /// invalid_argument for a message that is not a descriptor, unless it is a plane and the recording has planes.
  [[nodiscard]] Status append(std::int64_t time_ns, std::span<const std::byte> payload,
                              RecordedMessage message = RecordedMessage::descriptor);
  [[nodiscard]] Status flush();
  /// Size of the file, with what is not flushed yet.
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  RecordWriter(FilePointer file, RecordingKind kind) : file_(std::move(file)), kind_(kind) {}
  [[nodiscard]] Status append_record(std::int64_t time_ns, std::span<const std::byte> payload);
  FilePointer file_;
  RecordingKind kind_;
};

struct Record {
  std::int64_t time_ns = 0;
  std::vector<std::byte> payload;  ///< The message as received, byte for byte.
  RecordedMessage message = RecordedMessage::descriptor;
};

/// Reads records in order. An incomplete or damaged record ends the reading; its bytes are counted.
class RecordReader {
 public:
  /// data_loss, naming what was found, if the file is not a recording, or one of a later version.
  [[nodiscard]] static Result<RecordReader> open(const std::string& path);

  [[nodiscard]] const RecordingHeader& header() const { return header_; }
  /// Reads the next record into `out`, whose memory is reused; false at the end.
  [[nodiscard]] bool next(Record& out);
  /// Bytes after the last complete record; known once next() has returned false.
  [[nodiscard]] std::uint64_t torn_bytes() const { return torn_bytes_; }
  /// File offset of the end of the last complete record.
  [[nodiscard]] std::uint64_t good_bytes() const { return good_bytes_; }
  /// Returns to the first record after the header.
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

}  // namespace lightwell
