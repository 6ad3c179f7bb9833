"""The PHY's compiled code."""

import asyncio

import phy


async def load_phy() -> None:
    """Compile it, or load what is compiled."""
    await asyncio.to_thread(phy.warm_up)
