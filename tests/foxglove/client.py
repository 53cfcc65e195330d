"""A client of Foxglove's WebSocket protocol (foxglove.sdk.v1) that knows nothing of wormd: it decodes by the schemas it is sent.

Arguments: address, number of states to take. Prints one JSON object. Then waits for the warning that the worm is silent, and says so.
"""

import base64
import json
import struct
import sys

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.json_format import MessageToDict
from websockets.sync.client import connect

MESSAGE_DATA = 1


def decoder(channel):
    files = descriptor_pb2.FileDescriptorSet.FromString(base64.b64decode(channel["schema"]))
    pool = descriptor_pool.DescriptorPool()
    for file in files.file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(channel["schemaName"]))


def main():
    address, wanted = sys.argv[1], int(sys.argv[2])
    with connect(address, subprotocols=["foxglove.sdk.v1"], max_size=None) as socket:
        info = json.loads(socket.recv(timeout=30))
        channels = {}
        while len(channels) < 8:
            advertised = json.loads(socket.recv(timeout=30))
            channels.update({channel["topic"]: channel for channel in advertised.get("channels", [])})
        subscriptions = [{"id": 7, "channelId": channels["/state"]["id"]}]
        socket.send(json.dumps({"op": "subscribe", "subscriptions": subscriptions}))
        state = decoder(channels["/state"])
        states = []
        while len(states) < wanted:
            received = socket.recv(timeout=30)
            if isinstance(received, bytes) and received[0] == MESSAGE_DATA:
                subscription, log_time = struct.unpack_from("<IQ", received, 1)
                assert subscription == 7, subscription
                content = MessageToDict(
                    state.FromString(received[13:]),
                    preserving_proto_field_name=True,
                    always_print_fields_with_no_presence=True,
                )
                states.append({"log_time": log_time, "content": content})
        print(json.dumps({"info": info, "topics": sorted(channels), "states": states}), flush=True)
        while True:
            received = socket.recv(timeout=60)
            if isinstance(received, str) and json.loads(received)["op"] == "status":
                print(received, flush=True)
                break


main()
