"""Messages taken out of whole chunks, beside those that the library reads one after another."""

import numpy as np
import pytest
from rosbags.rosbag1 import Reader, Writer
from rosbags.typesys import Stores, get_typestore

from sagnac.formats.rosbag import messages_of

KIND = "std_msgs/msg/String"


def mixed(path, compression=None):
    """Two topics, messages of many lengths, some received late, in many small chunks."""
    store = get_typestore(Stores.ROS1_NOETIC)
    text = store.types[KIND]
    generator = np.random.default_rng(1)
    writer = Writer(path)
    if compression is not None:
        writer.set_compression(compression)
    with writer:
        writer.chunk_threshold = 2000
        topics = [writer.add_connection(name, KIND, typestore=store) for name in ("/a", "/bc")]
        for number in range(400):
            raw = store.serialize_ros1(text(data="x" * int(generator.integers(40))), KIND)
            late = int(generator.integers(3_000_000_000))
            writer.write(topics[int(generator.integers(2))], number * 10**9 + late, raw)
    return path


@pytest.mark.parametrize("compression", [None, Writer.CompressionFormat.BZ2])
def test_they_are_those_that_the_library_reads(tmp_path, compression):
    path = mixed(tmp_path / "run.bag", compression)
    with Reader(path) as reader:
        assert len(reader.chunks) > 5
        for connection in reader.connections:
            plain = [(when, raw) for _, when, raw in reader.messages(connections=[connection])]
            found = [
                (int(when), bytes(piece.chunk[begin:end]))
                for piece in messages_of(reader, connection.id)
                for when, begin, end in zip(piece.received, piece.begin, piece.end, strict=True)
            ]
            assert found == plain


def test_bytes_at_the_beginning_and_the_end(tmp_path):
    with Reader(mixed(tmp_path / "run.bag")) as reader:
        for piece in messages_of(reader, reader.connections[0].id):
            sizes = piece.first(0, 4).view("<u4")[:, 0]
            np.testing.assert_array_equal(sizes, piece.end - piece.begin - 4)
            long = piece.end - piece.begin >= 6
            assert np.all(piece.last(2)[long] == ord("x"))


def test_an_index_that_points_elsewhere_is_refused(tmp_path):
    with Reader(mixed(tmp_path / "run.bag")) as reader:
        number = reader.connections[0].id
        whole = list(reader.indexes[number])
        for shift in (1, 10**7):
            reader.indexes[number] = [
                entry._replace(offset=entry.offset + shift * (place == 3))
                for place, entry in enumerate(whole)
            ]
            with pytest.raises(ValueError, match=r"no message where|beyond its chunk|cut off"):
                list(messages_of(reader, number))
