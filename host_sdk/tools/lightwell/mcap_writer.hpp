// MCAP files of descriptors and planes, which carry their own schemas. Format: https://mcap.dev/spec
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <lightwell/files.hpp>
#include <lightwell/recording.hpp>
#include <lightwell/result.hpp>

namespace lightwell::tool {

/// When a message was measured and when it was received, ns since 1970 (UTC).
struct McapTime {
  std::uint64_t published_ns = 0, logged_ns = 0;
};

/// Writes chunks without compression, each with an index, and a summary at the end. A process that is killed loses the
/// messages of its last chunk, which are at most those of kChunkDuration; the chunks before it remain readable.
class McapWriter {
 public:
  /// A new or empty file. failed_precondition if there is content in it: an MCAP file cannot be continued.
  [[nodiscard]] static Result<McapWriter> create(const std::string& path, const std::string& probe_name);

  /// resource_exhausted if the disk is full. Messages of RecordedMessage::unknown are refused: invalid_argument.
  [[nodiscard]] Status append(const McapTime& time, std::span<const std::byte> message, RecordedMessage kind);
  /// Writes the last chunk and the summary. Nothing may be appended after it.
  [[nodiscard]] Status finish();

 private:
  static constexpr std::size_t kChunkBytes = std::size_t{1} << 20;
  static constexpr std::uint64_t kChunkDuration_ns = 1'000'000'000;
  /// Descriptors and planes.
  static constexpr std::size_t kChannels = 2;

  struct IndexEntry {
    std::uint64_t logged_ns = 0, offset = 0;  ///< Offset in the records of the chunk.
  };
  struct Channel {
    std::uint32_t messages = 0;  ///< Of the file; 0: not yet in it.
    std::vector<IndexEntry> in_chunk;
  };
  explicit McapWriter(FilePointer file) : file_(std::move(file)) {}
  [[nodiscard]] Status write(const std::string& bytes);
  [[nodiscard]] Status end_chunk();
  [[nodiscard]] std::string schema_and_channel(std::size_t channel) const;

  FilePointer file_;
  std::string probe_name_;
  std::uint64_t written_ = 0;  ///< Bytes in the file.
  std::array<Channel, kChannels> channels_;
  std::string chunk_;  ///< Records that are not written yet.
  std::uint64_t chunk_first_ns_ = 0, chunk_last_ns_ = 0, first_ns_ = 0, last_ns_ = 0;
  std::vector<std::string> chunk_indexes_;
};

}  // namespace lightwell::tool
