#!/usr/bin/python3
"""Replies that somebody gives up midway, for lack of time or by an interrupt: what else the connection is good for."""

import unittest
from unittest import mock

import atlas_pb2
from roadatlas import Code, geometry
from roadatlas.connection import Connection
from roadatlas.errors import ConnectionLost, DeadlinePassed
from roadatlas.transport import Transport
from support import EVERYWHERE, AtlasCase

MAX_WATCHES = 16
NEAR = geometry.disc(0, 0, 10)


class GivenUpTest(AtlasCase):

    def setUp(self):
        super().setUp()
        self.drive()

    def queries(self, client):
        """Both kinds of replies that are many frames."""
        return (lambda: client.query_region(atlas_pb2.QueryRegion()),
                lambda: client.sync(atlas_pb2.SyncRequest(area=EVERYWHERE)))

    def assert_serves(self, client):
        """And keeps nothing of what nobody waits for."""
        for query in self.queries(client):
            self.assertEqual({tile.key for tile in query().tiles}, set(self.map_now()))
        self.assertEqual(client.status().keyframes, 11)
        self.assertEqual((client._connection._arrived, client._connection._given_up), ({}, set()))

    def test_what_an_interrupt_leaves_of_a_reply_is_dropped(self):
        client = self.connect()
        whole = Connection.receive
        for query in self.queries(client):
            frames = iter(range(3))

            def receive(*arguments, frames=frames):
                if next(frames, None) is None:
                    raise KeyboardInterrupt
                return whole(*arguments)

            with mock.patch.object(Connection, "receive", receive), self.assertRaises(KeyboardInterrupt):
                query()
        self.assert_serves(client)

    def test_what_a_deadline_leaves_of_a_reply_is_dropped(self):
        client = self.connect()
        for query in self.queries(client):
            with self.stopped_daemon(), mock.patch.object(client, "_timeout_s", 0.1):
                with self.assertRaises(DeadlinePassed):
                    query()
        self.assert_serves(client)

    def test_a_watch_that_does_not_begin_in_time_is_cancelled(self):
        client = self.connect()
        with self.stopped_daemon(), mock.patch.object(client, "_timeout_s", 0.05):
            for _ in range(MAX_WATCHES):
                with self.assertRaises(DeadlinePassed):
                    client.watch(NEAR)
        self.assertEqual(client.status().keyframes, 11)
        watches = [client.watch(NEAR) for _ in range(MAX_WATCHES)]
        self.refused(Code.INVALID_ARGUMENT, client.watch, NEAR)
        for watch in watches:
            watch.cancel()
        self.assert_serves(client)

    def test_an_interrupt_that_may_have_lost_bytes_ends_the_connection(self):
        client = self.connect()
        whole = Transport.receive

        def receive_and_lose(transport):
            whole(transport)
            raise KeyboardInterrupt

        with mock.patch.object(Transport, "receive", receive_and_lose), self.assertRaises(KeyboardInterrupt):
            client.query_region(atlas_pb2.QueryRegion())
        for query in self.queries(client):
            with self.assertRaisesRegex(ConnectionLost, "connect again"):
                query()
        self.assert_serves(self.connect())


if __name__ == "__main__":
    unittest.main()
