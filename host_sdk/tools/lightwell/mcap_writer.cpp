#include "mcap_writer.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

#include <lightwell/bytes.hpp>
#include <lightwell/probe.hpp>
#include <lightwell/schema.hpp>

namespace lightwell::tool {
namespace {

constexpr std::string_view kMagic = "\x89MCAP0\r\n";
constexpr std::string_view kEncoding = "protobuf";

enum class Opcode : std::uint8_t {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  statistics = 0x0B,
  data_end = 0x0F,
};

/// By channel: descriptors, planes. Numbers of channels and schemas are 1 + the index.
constexpr std::array kKinds = {RecordedMessage::descriptor, RecordedMessage::plane};
constexpr std::array<std::string_view, kKinds.size()> kTopics = {"lightwell/descriptor", "lightwell/plane"};

std::uint16_t number_of(std::size_t channel) { return static_cast<std::uint16_t>(channel + 1); }

/// The fields of a record.
class Fields {
 public:
  template <class Number>
  Fields& number(Number value) {
    std::array<char, sizeof(Number)> bytes{};
    put_le(bytes.data(), value);
    bytes_.append(bytes.data(), bytes.size());
    return *this;
  }
  /// With its length before it: of a string, of bytes or of a map.
  Fields& text(std::string_view value) { return number(static_cast<std::uint32_t>(value.size())).raw(value); }
  Fields& raw(std::string_view value) {
    bytes_ += value;
    return *this;
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

std::string record(Opcode opcode, const Fields& fields) {
  return Fields()
      .number(static_cast<std::uint8_t>(opcode))
      .number(static_cast<std::uint64_t>(fields.bytes().size()))
      .raw(fields.bytes())
      .bytes();
}

std::uint32_t crc_of(std::string_view bytes) { return crc32(std::as_bytes(std::span(bytes))); }

}  // namespace

Result<McapWriter> McapWriter::create(const std::string& path, const std::string& probe_name) {
  Result<FilePointer> file = open_for_update(path);
  if (!file) return file.status();
  if (std::fseek(file->get(), 0, SEEK_END) == 0 && std::ftell(file->get()) > 0)
    return Status(StatusCode::failed_precondition,
                  path + ": the file exists, and an MCAP file cannot be continued; choose another name");
  McapWriter writer(std::move(*file));
  writer.probe_name_ = probe_name;
  const Fields header = Fields().text("").text("lightwell " + std::string(version()));
  if (Status s = writer.write(std::string(kMagic) + record(Opcode::header, header)); !s.ok()) return s;
  return writer;
}

Status McapWriter::write(const std::string& bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size() || std::fflush(file_.get()) != 0)
    return {StatusCode::resource_exhausted, std::string("the MCAP file cannot be written: ") + std::strerror(errno)};
  written_ += bytes.size();
  return {};
}

std::string McapWriter::schema_and_channel(std::size_t channel) const {
  const MessageSchema schema = message_schema(kKinds[channel]);
  const Fields metadata = Fields().text("probe").text(probe_name_);
  return record(
             Opcode::schema,
             Fields().number(number_of(channel)).text(schema.name).text(kEncoding).text(schema.file_descriptor_set)) +
         record(Opcode::channel, Fields()
                                     .number(number_of(channel))
                                     .number(number_of(channel))
                                     .text(kTopics[channel])
                                     .text(kEncoding)
                                     .text(metadata.bytes()));
}

Status McapWriter::append(const McapTime& time, std::span<const std::byte> message, RecordedMessage kind) {
  const auto found = std::ranges::find(kKinds, kind);
  if (found == kKinds.end()) return invalid_argument("neither a descriptor nor a message of a plane");
  const auto index = static_cast<std::size_t>(found - kKinds.begin());
  Channel& channel = channels_[index];
  if (!chunk_.empty() &&
      (chunk_.size() >= kChunkBytes || time.logged_ns - std::min(time.logged_ns, chunk_first_ns_) >= kChunkDuration_ns))
    if (Status s = end_chunk(); !s.ok()) return s;
  if (chunk_.empty()) chunk_first_ns_ = chunk_last_ns_ = time.logged_ns;
  if (channel.messages == 0) chunk_ += schema_and_channel(index);
  if (first_ns_ == 0) first_ns_ = last_ns_ = time.logged_ns;
  for (const auto& [first, last] : {std::pair(&chunk_first_ns_, &chunk_last_ns_), std::pair(&first_ns_, &last_ns_)}) {
    *first = std::min(*first, time.logged_ns);
    *last = std::max(*last, time.logged_ns);
  }
  channel.in_chunk.push_back({time.logged_ns, chunk_.size()});
  chunk_ += record(Opcode::message, Fields()
                                        .number(number_of(index))
                                        .number(channel.messages++)
                                        .number(time.logged_ns)
                                        .number(time.published_ns)
                                        .raw({reinterpret_cast<const char*>(message.data()), message.size()}));
  return {};
}

Status McapWriter::end_chunk() {
  const std::uint64_t start = written_, size = chunk_.size();
  const std::string chunk = record(Opcode::chunk, Fields()
                                                      .number(chunk_first_ns_)
                                                      .number(chunk_last_ns_)
                                                      .number(size)
                                                      .number(crc_of(chunk_))
                                                      .text("")
                                                      .number(size)
                                                      .raw(chunk_));
  chunk_.clear();
  Fields offsets;
  std::string indexes;
  for (std::size_t i = 0; i < kChannels; ++i) {
    if (channels_[i].in_chunk.empty()) continue;
    Fields entries;
    for (const IndexEntry& entry : channels_[i].in_chunk) entries.number(entry.logged_ns).number(entry.offset);
    channels_[i].in_chunk.clear();
    offsets.number(number_of(i)).number(start + chunk.size() + indexes.size());
    indexes += record(Opcode::message_index, Fields().number(number_of(i)).text(entries.bytes()));
  }
  chunk_indexes_.push_back(record(Opcode::chunk_index, Fields()
                                                           .number(chunk_first_ns_)
                                                           .number(chunk_last_ns_)
                                                           .number(start)
                                                           .number(static_cast<std::uint64_t>(chunk.size()))
                                                           .text(offsets.bytes())
                                                           .number(static_cast<std::uint64_t>(indexes.size()))
                                                           .text("")
                                                           .number(size)
                                                           .number(size)));
  return write(chunk + indexes);
}

Status McapWriter::finish() {
  if (!chunk_.empty())
    if (Status s = end_chunk(); !s.ok()) return s;
  // A checksum of 0: not available. Each chunk has its own.
  if (Status s = write(record(Opcode::data_end, Fields().number(std::uint32_t{0}))); !s.ok()) return s;
  const std::uint64_t summary_start = written_;
  std::string summary;
  Fields counts;
  std::uint64_t messages = 0;
  std::uint16_t channels = 0;
  for (std::size_t i = 0; i < kChannels; ++i) {
    if (channels_[i].messages == 0) continue;
    summary += schema_and_channel(i);
    counts.number(number_of(i)).number(std::uint64_t{channels_[i].messages});
    messages += channels_[i].messages;
    ++channels;
  }
  for (const std::string& index : chunk_indexes_) summary += index;
  summary += record(Opcode::statistics, Fields()
                                            .number(messages)
                                            .number(channels)
                                            .number(std::uint32_t{channels})
                                            .number(std::uint32_t{0})  // Attachments.
                                            .number(std::uint32_t{0})  // Metadata.
                                            .number(static_cast<std::uint32_t>(chunk_indexes_.size()))
                                            .number(first_ns_)
                                            .number(last_ns_)
                                            .text(counts.bytes()));
  // The checksum covers the summary and the footer up to itself.
  const std::string start_of_footer = Fields()
                                          .number(static_cast<std::uint8_t>(Opcode::footer))
                                          .number(std::uint64_t{20})
                                          .number(summary_start)
                                          .number(std::uint64_t{0})  // No offsets of the summary.
                                          .bytes();
  return write(summary + start_of_footer + Fields().number(crc_of(summary + start_of_footer)).bytes() +
               std::string(kMagic));
}

}  // namespace lightwell::tool
