// What a role may ask for of keyframes and their poses.
#include "server/net/access/access_check.h"

#include <gtest/gtest.h>

namespace atlas {
namespace {

Identity Of(Role role, const std::string& name = "") {
  Identity identity;
  identity.role = role;
  identity.name = name;
  return identity;
}

bool May(const Identity& identity, const wire::Envelope& request) {
  const Status status = CheckMayAsk(identity, request);
  EXPECT_TRUE(status.ok() || status.code() == StatusCode::kPermissionDenied);
  return status.ok();
}

wire::Envelope Reading(const std::string& vehicle) {
  wire::Envelope envelope;
  envelope.mutable_read_keyframes()->set_vehicle(vehicle);
  envelope.mutable_read_keyframes()->set_session("day");
  return envelope;
}

TEST(AccessCheckTest, AVehicleReadsItsOwnKeyframesAMergeAll) {
  EXPECT_TRUE(May(Of(Role::kVehicle, "bus"), Reading("bus")));
  EXPECT_FALSE(May(Of(Role::kVehicle, "bus"), Reading("tram")));
  EXPECT_TRUE(May(Of(Role::kVehicle), Reading("tram"))) << "whoever it is";
  EXPECT_FALSE(May(Of(Role::kReader, "bus"), Reading("bus")));
  EXPECT_TRUE(May(Of(Role::kMerge, "m"), Reading("bus")));
  EXPECT_TRUE(May(Of(Role::kAdmin), Reading("bus")));
}

TEST(AccessCheckTest, ABatchThatPublishesIsForMerges) {
  wire::Envelope batch;
  wire::UpdatePoses& poses = *batch.mutable_update_poses();
  poses.add_updates()->mutable_key()->set_vehicle("bus");
  poses.set_if_revision(7);
  EXPECT_TRUE(May(Of(Role::kVehicle, "bus"), batch)) << "its own, on a condition";
  poses.add_publish()->set_vehicle("bus");
  EXPECT_FALSE(May(Of(Role::kVehicle, "bus"), batch));
  EXPECT_FALSE(May(Of(Role::kReader), batch));
  EXPECT_TRUE(May(Of(Role::kMerge), batch));
  EXPECT_TRUE(May(Of(Role::kAdmin), batch));
}

TEST(AccessCheckTest, UndoingAndLookingForChangesIsForMerges) {
  wire::Envelope undo;
  undo.mutable_undo_poses()->set_batch(1);
  wire::Envelope sessions;
  sessions.mutable_sessions_request()->set_changed(true);
  for (const wire::Envelope& request : {undo, sessions}) {
    EXPECT_FALSE(May(Of(Role::kReader), request));
    EXPECT_FALSE(May(Of(Role::kVehicle, "bus"), request));
    EXPECT_TRUE(May(Of(Role::kMerge), request));
    EXPECT_TRUE(May(Of(Role::kAdmin), request));
  }
  sessions.mutable_sessions_request()->set_changed(false);
  EXPECT_TRUE(May(Of(Role::kReader), sessions));
}

}  // namespace
}  // namespace atlas
