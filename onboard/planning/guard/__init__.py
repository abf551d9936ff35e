"""Guards of a drive: the drive guard on its leg, the trust range, the cells under the wheels."""
