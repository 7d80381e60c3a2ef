// What a message of the protocol is made of, looked up once: Protobuf's own descriptors take a lock
// and a search a field.
#pragma once

#include <cstdint>
#include <vector>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/wire_format_lite.h>

namespace atlas {

class MessageShape;

struct FieldShape {
  using WireType = google::protobuf::internal::WireFormatLite::WireType;

  bool is_known = false;
  bool is_repeated = false;
  bool is_packable = false;
  bool is_blob = false;  // bytes
  WireType wire_type = WireType::WIRETYPE_VARINT;
  const MessageShape* nested = nullptr;  // where it is a message

  // Else Protobuf keeps it as one that it does not know.
  bool CanBe(WireType type) const {
    return is_known &&
           (type == wire_type || (is_packable && type == WireType::WIRETYPE_LENGTH_DELIMITED));
  }
  bool has_varints() const { return is_packable && wire_type == WireType::WIRETYPE_VARINT; }
};

class MessageShape {
 public:
  // Of an Envelope, and of all that can be in it.
  static const MessageShape& OfEnvelope();

  // By number; null: none.
  const FieldShape* Find(int number) const {
    const auto index = static_cast<std::size_t>(number);
    return index < fields_.size() && fields_[index].is_known ? &fields_[index] : nullptr;
  }

 private:
  friend class MessageShapes;
  std::vector<FieldShape> fields_;  // by number
};

}  // namespace atlas
