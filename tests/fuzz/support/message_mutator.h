// Mutation of Protobuf messages along their schema: fields appear, vanish, are repeated and change,
// and what was a message stays one.
#pragma once

#include <optional>

#include <google/protobuf/message.h>

#include "tests/fuzz/support/fuzz_target.h"

namespace atlas::fuzz {

// Another value for a field that is bytes; nullopt: any bytes will do.
using MutateBlob = std::optional<Bytes> (*)(const google::protobuf::FieldDescriptor& field,
                                            ByteSpan blob,
                                            Random& random);

// One change, somewhere in the message or below it.
void MutateMessage(google::protobuf::Message& message, Random& random, MutateBlob mutate_blob);

}  // namespace atlas::fuzz
