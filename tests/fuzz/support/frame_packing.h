// Streams of frames, and mutation of the envelopes in them: headers hold again.
#pragma once

#include "proto/wire/envelope.h"
#include "tests/fuzz/support/message_mutator.h"

namespace atlas::fuzz {

// One frame each.
Bytes FramesOf(const std::vector<wire::Envelope>& envelopes);
// Of those frames that are whole, one behind the other.
std::vector<Bytes> PayloadsOf(ByteSpan stream);

// Most times a field of one of the envelopes is changed; else frames are left out, doubled or
// swapped, and now and then bytes of a payload, a header or the stream.
Bytes MutateFrames(ByteSpan stream, std::size_t max_size, Random& random, MutateBlob mutate_blob);
// The same of the payload of one frame.
Bytes MutateEnvelope(ByteSpan payload,
                     std::size_t max_size,
                     Random& random,
                     MutateBlob mutate_blob);

// Blobs of uploads and tiles behind their checksums.
std::optional<Bytes> MutateWireBlob(const google::protobuf::FieldDescriptor& field,
                                    ByteSpan blob,
                                    Random& random);

}  // namespace atlas::fuzz
