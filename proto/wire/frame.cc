#include "proto/wire/frame.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>

#include "core/base/hash.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

// Frozen: "RAF1" (Road Atlas frame, version 1).
constexpr std::array<std::uint8_t, 4> kMagic = {'R', 'A', 'F', '1'};
constexpr std::size_t kKeptBytes = 4u << 10;  // of an empty buffer

std::uint32_t PayloadChecksum(ByteSpan payload) {
  return static_cast<std::uint32_t>(Hash64(payload));
}

bool StartsWithMagic(ByteSpan bytes) {
  for (std::size_t i = 0; i < kMagic.size() && i < bytes.size(); ++i) {
    if (bytes[i] != kMagic[i]) {
      return false;
    }
  }
  return true;
}

Status BadMagic() {
  return Status(StatusCode::kInvalidData,
                "frame: the first bytes are not RAF1; is this another protocol or port?");
}

}  // namespace

Bytes EncodeHeader(const FrameHeader& header) {
  Bytes out(kFrameHeaderBytes);
  WriteHeader(header, std::span<std::uint8_t, kFrameHeaderBytes>(out));
  return out;
}

void WriteHeader(const FrameHeader& header, std::span<std::uint8_t, kFrameHeaderBytes> out) {
  assert(header.payload_bytes <= kMaxFrameBytes);
  std::copy(kMagic.begin(), kMagic.end(), out.begin());
  for (std::size_t i = 0; i < 4; ++i) {
    out[4 + i] = static_cast<std::uint8_t>(header.payload_bytes >> (8 * i));
    out[8 + i] = static_cast<std::uint8_t>(header.checksum >> (8 * i));
  }
}

FrameHeader HeaderOf(ByteSpan payload) {
  return {static_cast<std::uint32_t>(payload.size()), PayloadChecksum(payload)};
}

Bytes EncodeFrameHeader(ByteSpan payload) {
  return EncodeHeader(HeaderOf(payload));
}

Result<FrameHeader> DecodeFrameHeader(ByteSpan header, std::uint32_t max_payload_bytes) {
  assert(header.size() == kFrameHeaderBytes);
  if (!StartsWithMagic(header)) {
    return Error(BadMagic());
  }
  ByteReader in(header.subspan(kMagic.size()));
  FrameHeader result;
  result.payload_bytes = in.U32();
  result.checksum = in.U32();
  if (result.payload_bytes > max_payload_bytes) {
    return Error(StatusCode::kInvalidData, StrCat("frame: payload of ", result.payload_bytes,
                                                  " bytes, expected at most ", max_payload_bytes));
  }
  return result;
}

Status CheckFramePayload(const FrameHeader& header, ByteSpan payload) {
  if (payload.size() != header.payload_bytes || PayloadChecksum(payload) != header.checksum) {
    return Status(StatusCode::kInvalidData,
                  StrCat("frame: payload of ", payload.size(),
                         " bytes does not have the checksum of its header"));
  }
  return {};
}

Result<ByteSpan> LargeFrame::Payload() const {
  const ByteSpan payload = ByteSpan(bytes_).subspan(begin_);
  if (Status status = CheckFramePayload(header_, payload); !status.ok()) {
    return Error(std::move(status));
  }
  return payload;
}

FrameDecoder::FrameDecoder(std::uint32_t max_payload_bytes)
    : max_payload_bytes_(max_payload_bytes) {}

void FrameDecoder::Push(ByteSpan bytes) {
  if (failure_) {
    return;
  }
  DropConsumed();
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

void FrameDecoder::DropConsumed() {
  buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(consumed_));
  consumed_ = 0;
  if (buffer_.capacity() > kKeptBytes + 4 * buffer_.size()) {
    buffer_.shrink_to_fit();
  }
}

Result<std::optional<ByteSpan>> FrameDecoder::Next() {
  if (failure_) {
    return Error(*failure_);
  }
  auto frame = TakeFrame();
  if (!frame) {
    failure_ = frame.error();
    buffer_ = {};
    consumed_ = 0;
  } else if (!*frame) {
    DropConsumed();
  }
  return frame;
}

std::optional<LargeFrame> FrameDecoder::TakeLarge(
    std::size_t above_bytes, const std::function<bool(ByteSpan payload)>& stays) {
  if (failure_ || pending_bytes() <= kFrameHeaderBytes + above_bytes) {
    return std::nullopt;
  }
  const std::size_t begin = consumed_ + kFrameHeaderBytes;
  const auto header = DecodeFrameHeader(ByteSpan(buffer_).subspan(consumed_, kFrameHeaderBytes),
                                        max_payload_bytes_);
  if (!header || header->payload_bytes <= above_bytes ||
      header->payload_bytes > buffer_.size() - begin ||
      stays(ByteSpan(buffer_).subspan(begin, header->payload_bytes))) {
    return std::nullopt;
  }
  const auto end = buffer_.begin() + static_cast<std::ptrdiff_t>(begin + header->payload_bytes);
  Bytes rest(end, buffer_.end());  // little beside what is taken, which is not copied
  buffer_.erase(end, buffer_.end());
  consumed_ = 0;
  return LargeFrame(*header, std::exchange(buffer_, std::move(rest)), begin);
}

Result<std::optional<ByteSpan>> FrameDecoder::TakeFrame() {
  const ByteSpan pending = ByteSpan(buffer_).subspan(consumed_);
  if (!StartsWithMagic(pending)) {
    return Error(BadMagic());
  }
  if (pending.size() < kFrameHeaderBytes) {
    return std::nullopt;
  }
  const auto header = DecodeFrameHeader(pending.first(kFrameHeaderBytes), max_payload_bytes_);
  if (!header) {
    return Error(header.error());
  }
  if (pending.size() - kFrameHeaderBytes < header->payload_bytes) {
    return std::nullopt;
  }
  const ByteSpan payload = pending.subspan(kFrameHeaderBytes, header->payload_bytes);
  if (Status status = CheckFramePayload(*header, payload); !status.ok()) {
    return Error(std::move(status));
  }
  consumed_ += kFrameHeaderBytes + payload.size();
  return payload;
}

}  // namespace atlas
