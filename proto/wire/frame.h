// Framing as a state machine over bytes: no I/O, no Protobuf (docs/protocol.md, "Frames").
//
// A frame is the 4 bytes "RAF1", the payload's length as uint32 little-endian, the low 32 bits of
// the payload's Hash64 as uint32 little-endian, then the payload (an Envelope).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>

#include "core/base/bytes.h"
#include "core/base/status.h"

namespace atlas {

inline constexpr std::size_t kFrameHeaderBytes = 12;
inline constexpr std::uint32_t kMaxFrameBytes = 48u << 20;  // payload
inline constexpr std::uint32_t kProtocolMajor = 1;
inline constexpr std::uint32_t kProtocolMinor = 11;

struct FrameHeader {
  std::uint32_t payload_bytes = 0;
  std::uint32_t checksum = 0;  // the low 32 bits of the payload's Hash64
};

void WriteHeader(const FrameHeader& header, std::span<std::uint8_t, kFrameHeaderBytes> out);
Bytes EncodeHeader(const FrameHeader& header);
// The one that goes before `payload`.
FrameHeader HeaderOf(ByteSpan payload);
Bytes EncodeFrameHeader(ByteSpan payload);

// Exactly kFrameHeaderBytes bytes in. kInvalidData when the magic is wrong (another protocol on
// this port) or the length is above `max_payload_bytes`.
Result<FrameHeader> DecodeFrameHeader(ByteSpan header, std::uint32_t max_payload_bytes);

// kInvalidData when the payload does not have the header's checksum.
Status CheckFramePayload(const FrameHeader& header, ByteSpan payload);

// A frame by itself, whole but not looked into: that takes as long as it is large.
class LargeFrame {
 public:
  // `bytes`: those of the payload, from `begin` on, are the last ones.
  LargeFrame(const FrameHeader& header, Bytes bytes, std::size_t begin)
      : header_(header), bytes_(std::move(bytes)), begin_(begin) {}

  std::size_t size() const { return kFrameHeaderBytes + header_.payload_bytes; }
  // As long as this lives. kInvalidData when it does not have the header's checksum.
  Result<ByteSpan> Payload() const;

 private:
  FrameHeader header_;
  Bytes bytes_;
  std::size_t begin_;
};

// Bytes in as they come, payloads out: for peers that read in arbitrary pieces. Holds what has
// arrived and was not handed out; memory grows with that, never with what a header claims, and
// goes when it is gone.
class FrameDecoder {
 public:
  explicit FrameDecoder(std::uint32_t max_payload_bytes = kMaxFrameBytes);

  // For the frames that Next() has not looked at yet.
  void set_max_payload_bytes(std::uint32_t bytes) { max_payload_bytes_ = bytes; }
  void Push(ByteSpan bytes);
  // The next whole payload, valid until the next call of anything here; nullopt if more bytes are
  // needed. An error is final.
  Result<std::optional<ByteSpan>> Next();
  // The next frame, if it is whole, its payload above this, and none of those that stay; else it is
  // for Next().
  std::optional<LargeFrame> TakeLarge(
      std::size_t above_bytes,
      const std::function<bool(ByteSpan payload)>& stays = [](ByteSpan) { return false; });
  // That have come and that Next() did not hand out.
  std::size_t pending_bytes() const { return buffer_.size() - consumed_; }

 private:
  Result<std::optional<ByteSpan>> TakeFrame();
  void DropConsumed();

  std::uint32_t max_payload_bytes_;
  Bytes buffer_;
  std::size_t consumed_ = 0;  // bytes of buffer_ already handed out
  std::optional<Status> failure_;
};

}  // namespace atlas
