// Envelopes in and out of frames: hostile bytes to a Protobuf message with every count capped
// before Protobuf allocates for it, and a message to a whole frame.
#pragma once

#include "proto/roadatlas/v1/atlas.pb.h"

#include "core/base/bytes.h"
#include "core/base/status.h"
#include "proto/wire/frame.h"

namespace atlas {

namespace wire = roadatlas::v1;

// Elements of repeated fields in one envelope: poses of a batch, sessions of a reply. Packed
// numbers of fixed size are not counted: they take no more room than they came in.
inline constexpr std::uint32_t kMaxRepeatedFields = 1u << 18;
// Fields this build does not know, in one envelope; they are skipped and dropped.
inline constexpr std::uint32_t kMaxUnknownFields = 1024;

// The payload of one frame. kInvalidData when it is not an Envelope, is larger than a frame may be
// or breaks one of the limits above. An envelope whose body this build does not know parses, with
// BODY_NOT_SET.
Result<wire::Envelope> ParseEnvelope(ByteSpan payload);

// Whether a payload is parsed as fast as one of `max_bytes`: it is an Envelope, and what it has
// more is in fields that are bytes, which are copied at once (a keyframe's blob). As fast itself.
bool IsSmallBesidesBlobs(ByteSpan payload, std::size_t max_bytes);

// Header and payload, ready to be written. kInvalidArgument when the payload is above
// kMaxFrameBytes.
Result<Bytes> EncodeEnvelopeFrame(const wire::Envelope& envelope);

}  // namespace atlas
