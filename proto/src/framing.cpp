#include <algorithm>
#include <cstring>
#include <limits>
#include <string>

#include <lightwell/bytes.hpp>
#include <lightwell/framing.hpp>

namespace lightwell {
namespace {

// 'L' 'W' 'F', and a byte that does not occur in text.
constexpr std::array<std::byte, 4> kMagic = {std::byte{'L'}, std::byte{'W'}, std::byte{'F'}, std::byte{0xA7}};

// Offsets of the header's fields; all little-endian.
constexpr std::size_t kVersionAt = 4, kKindAt = 5, kSessionAt = 8, kLengthAt = 12, kSequenceAt = 16, kPayloadCrcAt = 24,
                      kHeaderCrcAt = 28;

/// Limit of the payload. An unknown kind has the largest limit.
std::size_t limit_of(FrameKind kind) {
  if (kind == FrameKind::plane) return kMaxPlaneMessageBytes;
  return kind == FrameKind::request || kind == FrameKind::response ? kMaxLinkMessageBytes : kMaxDescriptorBytes;
}

}  // namespace

Status FrameWriter::write(FrameKind kind, std::span<const std::byte> payload, std::vector<std::byte>& out) {
  const std::size_t limit = limit_of(kind);
  if (payload.size() > limit)
    return {StatusCode::invalid_argument, "a message of " + std::to_string(payload.size()) +
                                              " bytes; one of this kind has at most " + std::to_string(limit)};
  const std::size_t bytes = kFrameHeaderBytes + payload.size();
  out.assign(bytes + (bytes % kFrameGranule == 0 ? 1 : 0), std::byte{0});
  std::byte* const head = out.data();
  std::copy(kMagic.begin(), kMagic.end(), head);
  head[kVersionAt] = std::byte{kFrameVersion};
  head[kKindAt] = static_cast<std::byte>(kind);
  put_le<std::uint32_t>(head + kSessionAt, session_);
  put_le<std::uint32_t>(head + kLengthAt, static_cast<std::uint32_t>(payload.size()));
  put_le<std::uint64_t>(head + kSequenceAt, ++sequence_);
  put_le<std::uint32_t>(head + kPayloadCrcAt, crc32c(payload));
  put_le<std::uint32_t>(head + kHeaderCrcAt, crc32c(std::span(out).first(kHeaderCrcAt)));
  std::copy(payload.begin(), payload.end(), out.begin() + kFrameHeaderBytes);
  return {};
}

struct FrameReader::Header {
  explicit Header(const std::byte* at)
      : version(std::to_integer<std::uint8_t>(at[kVersionAt])),
        kind(static_cast<FrameKind>(at[kKindAt])),
        session(get_le<std::uint32_t>(at + kSessionAt)),
        length(get_le<std::uint32_t>(at + kLengthAt)),
        sequence(get_le<std::uint64_t>(at + kSequenceAt)),
        payload_crc(get_le<std::uint32_t>(at + kPayloadCrcAt)) {}

  std::uint8_t version;
  FrameKind kind;
  std::uint32_t session, length;
  std::uint64_t sequence;
  std::uint32_t payload_crc;
};

FrameReader::FrameReader() : buffer_(kMaxFrameBytes) {}

void FrameReader::push(std::span<const std::byte> bytes, const FrameCallback& on_frame) {
  while (!bytes.empty()) {
    drop_consumed();
    const std::size_t now = std::min(bytes.size(), buffer_.size() - end_);
    std::copy_n(bytes.begin(), now, buffer_.begin() + static_cast<std::ptrdiff_t>(end_));
    end_ += now;
    bytes = bytes.subspan(now);
    search(Search::partial, on_frame);
  }
}

void FrameReader::end_transfer(const FrameCallback& on_frame) {
  search(Search::final, on_frame);
  at_boundary_ = true;
}

void FrameReader::begin_stream() {
  if (begin_ < end_) {
    ++counters_.cut_off;
    counters_.skipped_bytes += end_ - begin_;
  }
  begin_ = end_ = 0;
  at_boundary_ = true;
}

void FrameReader::search(Search search, const FrameCallback& on_frame) {
  while (begin_ < end_ && step(search, on_frame) == Step::advanced) {
  }
  if (begin_ == end_) begin_ = end_ = 0;
}

FrameReader::Step FrameReader::step(Search search, const FrameCallback& on_frame) {
  const std::byte* const at = buffer_.data() + begin_;
  const std::size_t here = end_ - begin_;
  if (at_boundary_ && *at == std::byte{0}) {
    ++begin_;
    return Step::advanced;
  }
  if (!std::equal(kMagic.begin(), kMagic.begin() + static_cast<std::ptrdiff_t>(std::min(here, kMagic.size())), at))
    return skip();
  const auto unfinished = [&] { return search == Search::partial ? Step::needs_more : reject(counters_.cut_off); };
  if (here < kFrameHeaderBytes) return unfinished();
  if (crc32c({at, kHeaderCrcAt}) != get_le<std::uint32_t>(at + kHeaderCrcAt)) return reject(counters_.bad_headers);
  const Header header(at);
  // The content of an oversized frame is treated as damage: it is searched for the next header.
  if (header.length > limit_of(header.kind)) return reject(counters_.oversized);
  if (here < kFrameHeaderBytes + header.length) return unfinished();
  const std::span payload(at + kFrameHeaderBytes, header.length);
  // The length may be wrong because bytes were lost, so the search continues directly after the header's first byte.
  if (crc32c(payload) != header.payload_crc) return reject(counters_.bad_payloads);
  begin_ += kFrameHeaderBytes + header.length;
  at_boundary_ = true;
  deliver(header, payload, on_frame);
  return Step::advanced;
}

FrameReader::Step FrameReader::skip() {
  ++begin_;
  ++counters_.skipped_bytes;
  at_boundary_ = false;
  return Step::advanced;
}

FrameReader::Step FrameReader::reject(std::uint64_t& counter) {
  ++counter;
  return skip();
}

void FrameReader::deliver(const Header& header, std::span<const std::byte> payload, const FrameCallback& on_frame) {
  if (!is_new(header)) {
    ++counters_.replayed;
    return;
  }
  if (header.version != kFrameVersion || header.kind < FrameKind::descriptor || header.kind > FrameKind::plane) {
    ++counters_.unknown;
    return;
  }
  ++counters_.frames;
  on_frame({header.kind, header.session, header.sequence, payload});
}

bool FrameReader::is_new(const Header& header) {
  if (header.sequence == 0) return false;
  if (session_ == header.session) {
    if (header.sequence <= sequence_) return false;
    const std::uint64_t missing = header.sequence - sequence_ - 1;
    counters_.lost += std::min(missing, std::numeric_limits<std::uint64_t>::max() - counters_.lost);
  } else {
    const std::span ended = std::span(ended_).first(std::min(ended_count_, ended_.size()));
    if (std::ranges::find(ended, header.session) != ended.end()) return false;
    // In the first frame of a session, earlier sequence numbers do not count as lost: the reader may have started
    // later.
    if (session_) ended_[ended_count_++ % ended_.size()] = *session_;
    session_ = header.session;
  }
  sequence_ = header.sequence;
  return true;
}

void FrameReader::drop_consumed() {
  if (begin_ == 0) return;
  std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
  end_ -= begin_;
  begin_ = 0;
}

}  // namespace lightwell
