#include "proto/wire/message_shape.h"

#include <cassert>
#include <map>

#include "proto/roadatlas/v1/atlas.pb.h"

namespace atlas {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::internal::WireFormatLite;

// Those of all messages that can be within each other.
class MessageShapes {
 public:
  const MessageShape& Of(const Descriptor& type) {
    const auto [entry, is_new] = shapes_.try_emplace(&type);
    MessageShape& shape = entry->second;
    if (is_new) {
      for (int i = 0; i < type.field_count(); ++i) {
        Add(*type.field(i), shape);
      }
    }
    return shape;
  }

 private:
  static constexpr int kMaxNumber = 4'096;

  void Add(const FieldDescriptor& field, MessageShape& shape) {
    assert(field.number() <= kMaxNumber);
    const auto index = static_cast<std::size_t>(field.number());
    FieldShape one;
    one.is_known = true;
    one.is_repeated = field.is_repeated();
    one.is_packable = field.is_packable();
    one.is_blob = field.type() == FieldDescriptor::TYPE_BYTES;
    one.wire_type =
        WireFormatLite::WireTypeForFieldType(static_cast<WireFormatLite::FieldType>(field.type()));
    one.nested = field.message_type() == nullptr ? nullptr : &Of(*field.message_type());
    if (shape.fields_.size() <= index) {
      shape.fields_.resize(index + 1);
    }
    shape.fields_[index] = one;
  }

  std::map<const Descriptor*, MessageShape> shapes_;
};

const MessageShape& MessageShape::OfEnvelope() {
  static MessageShapes shapes;
  static const MessageShape& envelope = shapes.Of(*roadatlas::v1::Envelope::descriptor());
  return envelope;
}

}  // namespace atlas
