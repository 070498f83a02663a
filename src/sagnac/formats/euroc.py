"""A folder of EuRoC: ``mav0/imu0/data.csv`` with the six axes of an IMU, and its ``sensor.yaml``.

Layout, header and keys are those of the data set's own description (Burri et al., The EuRoC micro
aerial vehicle datasets, *Int. J. Robot. Res.* 35, 1157, 2016; ASL format).
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

import pyarrow as pa
from pyarrow import csv as arrow_csv

from sagnac.arrays import blocks
from sagnac.formats.csv import open_source
from sagnac.formats.files import replacing_folder
from sagnac.formats.registry import EUROC_DATA, EUROC_SENSOR
from sagnac.formats.source import MADE, Outgoing
from sagnac.units import Sensor

__all__ = ["open_source", "write"]

_COLUMNS: Final = (
    *(f"w_RS_S_{axis} [rad s^-1]" for axis in "xyz"),
    *(f"a_RS_S_{axis} [m s^-2]" for axis in "xyz"),
)
_TIME: Final = "#timestamp [ns]"
_SENSOR: Final = f"""# {MADE}
sensor_type: imu
comment: {{comment}}
T_BS:
  cols: 4
  rows: 4
  data: [1.0, 0.0, 0.0, 0.0,
         0.0, 1.0, 0.0, 0.0,
         0.0, 0.0, 1.0, 0.0,
         0.0, 0.0, 0.0, 1.0]
rate_hz: {{rate!r}}
"""
_DENSITIES: Final = """
# The noisiest axis sets each number; a sample has white noise of the density times sqrt(rate_hz).
# Bias instability and Markov rates have no key here: a filter needs a random walk for them, too.
gyroscope_noise_density: {gyro[0]:.6e}     # rad/s/sqrt(Hz)
gyroscope_random_walk: {gyro[1]:.6e}       # rad/s^2/sqrt(Hz)
accelerometer_noise_density: {accelerometer[0]:.6e} # m/s^2/sqrt(Hz)
accelerometer_random_walk: {accelerometer[1]:.6e}   # m/s^3/sqrt(Hz)
"""


def write(
    path: Path, out: Outgoing, densities: Mapping[Sensor, tuple[float, float]] | None = None
) -> None:
    """The folder, with the rates in SI.

    Parameters
    ----------
    path
        Of the folder.
    out
        Rates of three gyros and three accelerometers.
    densities
        N and K of the gyros and of the accelerometers, SI, if they are known.
    """
    comment = "noise densities are not known" if densities is None else "noise is as simulated"
    names = [name for name in out.kinds if name not in out.accelerometers]
    with replacing_folder(path) as folder:
        (folder / EUROC_SENSOR).parent.mkdir(parents=True)
        stated = _SENSOR.format(comment=comment, rate=out.sample_rate)
        if densities is not None:
            stated += _DENSITIES.format(**{str(one): each for one, each in densities.items()})
        (folder / EUROC_SENSOR).write_text(stated, encoding="utf-8")
        with (folder / EUROC_DATA).open("wb") as stream:
            stream.write((",".join((_TIME, *_COLUMNS)) + "\n").encode())
            options = arrow_csv.WriteOptions(include_header=False, quoting_style="none")
            for block in blocks(out.samples):
                axes = [out.columns[name][block] for name in (*names, *out.accelerometers)]
                rows = dict(zip((_TIME, *_COLUMNS), (out.stamps(block), *axes), strict=True))
                arrow_csv.write_csv(pa.table(rows), stream, options)
