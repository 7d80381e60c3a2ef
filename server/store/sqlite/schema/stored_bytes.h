// How much is stored, as the transaction at hand leaves it.
#pragma once

#include <cstdint>
#include <string>

#include "server/store/sqlite/connection/connection.h"

namespace atlas {

// Adds up the blobs of each vehicle, so that nobody does for each upload; from now on the
// statements of this connection keep the sums. In a table of the connection alone, of the same
// transaction as what it counts: what fails is not counted.
void KeepVehicleBytes(Connection& connection);
// The same from now on alone, of a table of sessions that was written anew.
void KeepVehicleBytesOfChanges(Connection& connection);
// 0: nothing is stored of it. Of a connection that keeps the sums.
std::uint64_t ReadVehicleBytes(Connection& connection, const std::string& vehicle);

// The pages of the database, without those that are free to be used again.
std::uint64_t ReadUsedBytes(Connection& connection);

}  // namespace atlas
